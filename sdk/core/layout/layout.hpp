#pragma once
// What both sides of a stream must agree on before the first byte is read.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// Frames that any client may simulate beyond its last delta at most. Sessions use 0 or 1.
inline constexpr std::uint32_t kMaxLead = 8;

/// Which of a session's streams, and its how many-th restart with another layout within an epoch.
struct StreamId {
  std::uint32_t id = 0;
  std::uint32_t generation = 0;
  friend bool operator==(const StreamId&, const StreamId&) = default;
};

/// Decides how the bytes of a stream are read and how its predicted step is taken. The server chooses it, the
/// session announces it, and a client builds its timeline from it; it never changes within a generation.
struct Layout {
  std::uint32_t capacity = 0;  ///< slots, 1 .. kMaxCapacity
  TypeId type_count = 1;       ///< types are 0 .. type_count - 1
  std::uint32_t lead = 1;      ///< A: frames a client may simulate beyond its last delta
  std::uint32_t region_blocks =
      0;  ///< blocks of a region; 0, the one value that is played: one region of all
  std::vector<std::string> groups{kPositionGroup};  ///< channel groups in the order of their columns
  /// Of the sphere about a body's centre that holds its surface, lattice units, by type, 1 .. 2^30. With
  /// orientations alone.
  std::vector<std::int32_t> radii;
  std::string codec = "tracker";
  std::vector<std::byte> codec_tables;  ///< see make_codec()
  /// Of frame 0; a snapshot holds those in force.
  StreamParameters parameters;
  std::string predictor = "ballistic";
  std::vector<std::int32_t> predictor_constants;  ///< see make_predictor()
  friend bool operator==(const Layout&, const Layout&) = default;
};

/// Of a layout that passed check_layout().
[[nodiscard]] Groups groups_of(const Layout& layout);

/// Checks every number and the groups; whether codec and predictor exist and fit their tables, only making
/// them shows. Errors: kInvalidArgument, kUnsupported (groups, regions).
[[nodiscard]] Result<void> check_layout(const Layout& layout);

/// XXH3-64 of the layout as a text: idl/PROTOCOL.md, "Layout hash". A client that computes another value must
/// not play. `lattice_unit_bits`: the session's lattice unit as an IEEE 754 bit pattern, since a client shows
/// bodies by it, although nothing here computes with it.
[[nodiscard]] std::uint64_t layout_hash(const Layout& layout, std::uint32_t protocol_version,
                                        std::uint64_t lattice_unit_bits);

}  // namespace tandem
