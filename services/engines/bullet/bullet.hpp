#pragma once

#include <memory>

#include "services/engines/bullet/world.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Whether this build has Bullet.
[[nodiscard]] bool bullet_is_built();

/// Makes the simulation of `world` in Bullet, at frame 0. It uses one thread. Deterministic for a seed and
/// inputs with one build on one machine; across machines Bullet promises nothing. Errors: kInvalidArgument,
/// naming the value that is out of range; kUnsupported if the build has no Bullet.
[[nodiscard]] Result<std::unique_ptr<Simulation>> make_bullet(const RigidWorld& world);

}  // namespace tandem::engine
