#pragma once
// A scene as the planner's world.

#include <cstdint>
#include <vector>

#include "services/engines/scenes/scene.hpp"
#include "services/host/planning/plan.hpp"
#include "tandem/result.hpp"

namespace tandem::sessions {

/// An operator's wishes for a scene.
struct SessionChoice : planning::Wishes {
  std::uint32_t bodies = 0;
};

[[nodiscard]] planning::PlannedWorld world_of(const scenes::Scene& scene, std::uint32_t bodies);

// The planner's functions of the same names, with the scene as the world.
[[nodiscard]] Result<host::StreamConfig> plan_stream(const scenes::Scene& scene, const SessionChoice& choice);
[[nodiscard]] Result<host::HostConfig> plan_session(const scenes::Scene& scene, const SessionChoice& choice);

}  // namespace tandem::sessions
