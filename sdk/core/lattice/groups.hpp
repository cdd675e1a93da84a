#pragma once
// Channel groups. Everything that the core has to know about a group is one line of kChannelGroups. README.md
// says what else a new one needs.

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

/// The names of the groups in a layout: p, v and c; the quaternion and the angular velocity.
inline constexpr const char* kPositionGroup = "position";
inline constexpr const char* kOrientationGroup = "orientation";

/// The bits of the groups in teleports.
inline constexpr std::uint8_t kMovesPosition = 1, kMovesOrientation = 2;

/// The groups that a stream has besides position, which every stream has.
struct Groups {
  bool orientation = false;
  friend bool operator==(const Groups&, const Groups&) = default;
};

/// The place and speed of one body. `p` in lattice units, |p| <= 2^30; `v` in 1/64 unit per frame, |v| <=
/// 2^28. `q` and `w` are valid if the stream has orientations.
struct BodyState {
  Vec3i p{};
  Vec3i v{};
  Quaternion q = kNoTurn;
  Spin w{};
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

/// The value that a snapshot expects for a body's number.
enum class Guess : std::uint8_t {
  kZero,
  kBefore,  ///< the number of the previous body: adjacent slots hold adjacent bodies
  kHalf,    ///< half way from the previous guess to that number; of bodies at rest as kBefore
  kRest,    ///< of bodies at rest as kBefore, of others 0
  kNorm,    ///< what gives a norm of 1 with the three columns before, not negative
  kSame,    ///< 0 stands for the number of the previous body, and that number for 0
};

/// Columns of a state that are alike, such as those of a vector.
struct ColumnRun {
  std::uint8_t columns = 0;
  std::int32_t limit = 0;  ///< maximum magnitude in a snapshot
  Guess guess = Guess::kZero;
};

struct ChannelGroup {
  std::string_view name;            ///< its name in a layout
  std::uint8_t bit = 0;             ///< its bit in teleports
  bool Groups::*listed = nullptr;   ///< null: every stream has the group
  bool needs_radii = false;         ///< the group needs Layout::radii
  std::size_t first_column = 0;     ///< number of its first column in State, after those of the previous
                                    ///< groups
  std::array<ColumnRun, 3> runs{};  ///< its columns in State, in the hash and in snapshots
};

/// All groups, in the order of layouts, hashes, records and snapshots.
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
     .runs = {{{3, kQuaternionOne, Guess::kRest},  // q x, y, z
               {1, kQuaternionOne, Guess::kNorm},  // q w
               {kSpinChannels, kSpinLimit}}}},     // w
}};
inline constexpr std::size_t kColumns = 16;  ///< columns of all groups

/// True if all values may be in a delta or a snapshot. Default values of groups that a stream does not have
/// are valid.
[[nodiscard]] bool valid_body(const BodyState& body);

/// The maximum error of a point of a body's surface: the distance of the centres plus 2 r sin(angle / 2),
/// lattice units, rounded up; at most one lattice unit above the true value. For states with orientations.
[[nodiscard]] std::uint64_t surface_error(const BodyState& body, const BodyState& target,
                                          std::int32_t radius);

/// The part of a predicted step that all predictors share; call it after to.rest() is written. Turns every
/// body that is not at rest by its angular velocity, which does not change (idl/PROTOCOL.md, "Turn"). Does
/// nothing in a stream of positions. `from` and `to` may be the same object.
void step_groups(const State& from, State& to);
/// Does the same for the listed slots only.
void step_groups(const State& from, State& to, std::span<const Slot> slots);

// The following functions name no group.

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

/// The groups of a stream as bits.
[[nodiscard]] std::uint8_t bits_of(const Groups& groups);

/// The part of a body that a lifecycle record holds for these groups (bits): p and v, q and w. The functions
/// write it, read it, give its size in bytes, and copy it from one body to another.
void put_body(unsigned groups, const BodyState& body, ByteWriter& out);
void get_body(unsigned groups, ByteReader& in, BodyState& body);
[[nodiscard]] std::size_t body_bytes(unsigned groups);
void move_body(unsigned groups, const BodyState& from, BodyState& to);

}  // namespace tandem
