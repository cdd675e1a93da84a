#pragma once
// Channel groups: all that the core has to know of one, a line each of kChannelGroups. What else a new one
// needs stands in README.md.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "sdk/core/lattice/turn.hpp"

namespace tandem {

class ByteReader;
class ByteWriter;
class State;
using Slot = std::uint32_t;
using Vec3i = std::array<std::int32_t, 3>;

inline constexpr std::int32_t kPositionLimit = 1 << 30;
inline constexpr std::int32_t kVelocityLimit = 1 << 28;

/// Their names in a layout: p, v and c; the quaternion and the angular velocity.
inline constexpr const char* kPositionGroup = "position";
inline constexpr const char* kOrientationGroup = "orientation";

/// Their bits in teleports.
inline constexpr std::uint8_t kMovesPosition = 1, kMovesOrientation = 2;

/// Which of them a stream has beside position, which every stream has.
struct Groups {
  bool orientation = false;
  friend bool operator==(const Groups&, const Groups&) = default;
};

/// One body's place and speed. `p` in lattice units, |p| <= 2^30; `v` in 1/64 unit per frame, |v| <= 2^28.
/// `q` and `w`, valid ones, where the stream has orientations.
struct BodyState {
  Vec3i p{};
  Vec3i v{};
  Quaternion q = kNoTurn;
  Spin w{};
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

/// What a snapshot expects a body's number to be.
enum class Guess : std::uint8_t {
  kZero,
  kBefore,  ///< that of the body before: slots were filled side by side
  kHalf,    ///< half way from the guess before to that number
};

/// Columns of a state that are alike, such as those of a vector.
struct ColumnRun {
  std::uint8_t columns = 0;
  std::int32_t limit = 0;  ///< of their magnitudes, in a snapshot
  Guess guess = Guess::kZero;
};

struct ChannelGroup {
  std::string_view name;            ///< in a layout
  std::uint8_t bit = 0;             ///< in teleports
  bool Groups::*listed = nullptr;   ///< null: in every stream
  bool needs_radii = false;         ///< Layout::radii
  std::size_t first_column = 0;     ///< of State's: behind those of the groups before
  std::array<ColumnRun, 3> runs{};  ///< from there on; also in hash and snapshots
};

/// In the order of layouts, hashes, records and snapshots.
inline constexpr std::array<ChannelGroup, 2> kChannelGroups{{
    {.name = kPositionGroup,
     .bit = kMovesPosition,
     .runs = {{{3, kPositionLimit, Guess::kBefore},   // p
               {3, kVelocityLimit, Guess::kHalf},     // v
               {3, kVelocityLimit, Guess::kHalf}}}},  // c
    {.name = kOrientationGroup,
     .bit = kMovesOrientation,
     .listed = &Groups::orientation,
     .needs_radii = true,
     .first_column = 9,
     .runs = {{{kQuaternionChannels, kQuaternionOne}, {kSpinChannels, kSpinLimit}}}},  // q, w
}};
inline constexpr std::size_t kColumns = 16;  ///< of all groups

/// Whether all values may be in a delta or a snapshot; those of groups that a stream has not are, as they are
/// made.
[[nodiscard]] bool valid_body(const BodyState& body);

/// How far a point of the surface of a body may be off: the distance of the centres and 2 r sin(angle / 2),
/// lattice units, rounded up; at most a lattice unit more than it is. States with orientations.
[[nodiscard]] std::uint64_t surface_error(const BodyState& body, const BodyState& target,
                                          std::int32_t radius);

/// The part of a predicted step that all predictors share, after they have written to.rest(): turns every
/// body that is not at rest by its angular velocity, which stays (idl/PROTOCOL.md, "Turn"). Nothing in a
/// stream of positions. `from` and `to` may be the same object.
void step_groups(const State& from, State& to);
/// The same for the listed slots only.
void step_groups(const State& from, State& to, std::span<const Slot> slots);

// From here on nothing names a group.

template <class Visit>
constexpr void for_each_group(const Groups& groups, const Visit& visit) {
  for (const ChannelGroup& each : kChannelGroups) {
    if (each.listed == nullptr || groups.*each.listed) visit(each);
  }
}

/// Calls visit(number of the column in State, its run) in order.
template <class Visit>
constexpr void for_each_column(const ChannelGroup& group, const Visit& visit) {
  std::size_t column = group.first_column;
  for (const ColumnRun& run : group.runs) {
    for (std::size_t i = 0; i < run.columns; ++i) visit(column++, run);
  }
}

/// Of all that a stream has, as bits.
[[nodiscard]] std::uint8_t bits_of(const Groups& groups);

/// What a lifecycle record says of a body with these groups (bits): p and v, q and w. As bytes; how many; and
/// from one body to another.
void put_body(unsigned groups, const BodyState& body, ByteWriter& out);
void get_body(unsigned groups, ByteReader& in, BodyState& body);
[[nodiscard]] std::size_t body_bytes(unsigned groups);
void move_body(unsigned groups, const BodyState& from, BodyState& to);

}  // namespace tandem
