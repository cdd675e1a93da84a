#pragma once
// Which channel groups a session has.

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/layout/layout.hpp"
#include "services/host/lattice_choice.hpp"
#include "services/scenes/scene.hpp"
#include "tandem/result.hpp"

namespace tandem::sessions {

/// Sets groups and radii of `layout`: orientations where the scene's bodies have them and a codec with these
/// traits codes them, else positions alone. A radius is that of the sphere around a body of its type, rounded
/// up to the lattice. Errors: kInvalidArgument for a type without a radius, or one that does not fit the
/// lattice.
[[nodiscard]] Result<void> choose_groups(const scenes::Scene& scene, const host::Lattice& lattice,
                                         const CodecTraits& traits, Layout& layout);

}  // namespace tandem::sessions
