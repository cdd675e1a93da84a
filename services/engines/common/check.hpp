#pragma once
// Checks what a particle simulation accepts: worlds at the start, inputs at run time.

#include "services/engines/common/world.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Also false for a point with a coordinate that is not a number.
[[nodiscard]] inline bool inside(const Vec3f& p, const Vec3f& low, const Vec3f& high) {
  return p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1] && p[2] >= low[2] &&
         p[2] <= high[2];
}

/// Errors: kInvalidArgument with the rule that `world` breaks.
[[nodiscard]] Result<void> check(const EngineWorld& world);

[[nodiscard]] Classification classify_input(const Input& input, const EngineWorld& world);

/// The budget of pushes of one participant.
[[nodiscard]] InputBudget input_budget(const EngineWorld& world);
/// The cost of a push: its velocity change times the share of the bodies that it reaches; 0 for other inputs.
/// A scene counts as at least kFewBodies bodies, and the share as at least kLeastShare: otherwise thousands
/// of pushes at single bodies would cost nothing. Looks at up to kCountedBodies bodies, evenly among the
/// slots.
[[nodiscard]] double push_cost(const Input& input, const Bodies& bodies);

inline constexpr std::uint32_t kFewBodies = 64;
/// With the budget of a scene that names none (kDefaultPushBudget), five pushes a second of half the largest
/// strength are always possible at up to this share of the bodies.
inline constexpr double kLeastShare = 1.0 / 20;
/// The budget as a share of the scene's max_push. If it were above the strength of gravity, one participant
/// could lift all bodies for ever.
inline constexpr double kDefaultPushBudget = 1.0 / 8;
inline constexpr std::size_t kCountedBodies = 4096;

}  // namespace tandem::engine
