#pragma once
// Checks what a simulation of rigid bodies accepts: worlds at the start, inputs at run time.

#include "services/engines/bullet/motion.hpp"
#include "services/engines/bullet/world.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Errors: kInvalidArgument with the rule that `world` breaks.
[[nodiscard]] Result<void> check(const RigidWorld& world);

[[nodiscard]] MotionLimits motion_limits(const EngineWorld& world);

[[nodiscard]] Classification classify_input(const Input& input, const RigidWorld& world);

}  // namespace tandem::engine
