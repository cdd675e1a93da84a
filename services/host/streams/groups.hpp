#pragma once
// Chooses a stream's channel groups.

#include <span>
#include <string_view>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/layout/layout.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

/// A body type with the radius of the sphere around a body, scene units.
struct BodySize {
  std::string_view name;
  double radius = 0;
};

/// Sets groups and radii of `layout`: orientations if the bodies turn and a codec with these traits codes
/// them, otherwise only positions. Radii are rounded up to the lattice. Errors: kInvalidArgument for a type
/// without a radius, or with one that does not fit the lattice.
[[nodiscard]] Result<void> choose_groups(bool turns, std::span<const BodySize> types, const Lattice& lattice,
                                         const CodecTraits& traits, Layout& layout);

}  // namespace tandem::host
