#pragma once
// Checks what a particle simulation accepts: worlds at the start, inputs at run time.

#include "services/engine/common/world.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Also false for a point with a coordinate that is not a number.
[[nodiscard]] inline bool inside(const Vec3f& p, const Vec3f& low, const Vec3f& high) {
  return p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1] && p[2] >= low[2] &&
         p[2] <= high[2];
}

/// Errors: kInvalidArgument with the rule that `world` breaks.
[[nodiscard]] Result<void> check(const World& world);

[[nodiscard]] Classification classify_input(const Input& input, const World& world);

}  // namespace tandem::engine
