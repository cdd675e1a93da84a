#pragma once
// What both sides of a stream must agree on before the first byte is read.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/data_fields.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// Maximum number of frames that any client may simulate beyond its last delta. Sessions use 0 or 1.
inline constexpr std::uint32_t kMaxLead = 8;

/// Identifies a stream; `generation` counts its restarts with another layout within an epoch.
struct StreamId {
  std::uint32_t id = 0;
  std::uint32_t generation = 0;
  friend bool operator==(const StreamId&, const StreamId&) = default;
};

/// What a session tells beside bodies: idl/PROTOCOL.md, "News". All its streams tell the same.
struct WorldFeatures {
  bool keys = false, events = false;
  [[nodiscard]] bool any() const { return keys || events; }
  friend bool operator==(const WorldFeatures&, const WorldFeatures&) = default;
};

/// Decides how the bytes of a stream are read and how its predicted step is computed. The server chooses the
/// layout, the session announces it, and a client builds its timeline from it. It never changes within a
/// generation.
struct Layout {
  std::uint32_t capacity = 0;  ///< slots, 1 .. kMaxCapacity
  TypeId type_count = 1;       ///< types are 0 .. type_count - 1
  std::uint32_t lead = 1;      ///< A: frames that a client may simulate beyond its last delta
  WorldFeatures world;         ///< the session's
  std::vector<std::string> groups{kPositionGroup};  ///< channel groups in the order of their columns
  std::vector<DataField> data;  ///< the session's fields, if the stream lists the group `data`
  /// Radius of the sphere around a body's centre that holds its surface, lattice units, by type, 1 .. 2^30.
  /// Only with orientations.
  std::vector<std::int32_t> radii;
  std::string codec = "tracker";
  std::vector<std::byte> codec_tables;  ///< see make_codec()
  /// The parameters of frame 0; a snapshot holds those in force.
  StreamParameters parameters;
  std::string predictor = "ballistic";
  std::vector<std::int32_t> predictor_constants;  ///< see make_predictor()
  friend bool operator==(const Layout&, const Layout&) = default;
};

/// The groups of a layout that passed check_layout().
[[nodiscard]] Groups groups_of(const Layout& layout);

/// Checks every number and the groups. Whether codec and predictor exist and fit their tables shows only when
/// they are made. Errors: kInvalidArgument, kUnsupported (groups).
[[nodiscard]] Result<void> check_layout(const Layout& layout);

/// The XXH3-64 of the layout as a text: idl/PROTOCOL.md, "Layout hash". A client that computes another value
/// must not play. `lattice_unit_bits`: the session's lattice unit as an IEEE 754 bit pattern; nothing here
/// computes with it, but a client shows bodies by it.
[[nodiscard]] std::uint64_t layout_hash(const Layout& layout, std::uint32_t protocol_version,
                                        std::uint64_t lattice_unit_bits);

}  // namespace tandem
