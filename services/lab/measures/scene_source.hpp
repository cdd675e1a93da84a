#pragma once
// The source of a measurement: a scene's simulation with the actions of its scripted users.

#include <cstdint>
#include <memory>
#include <vector>

#include "services/engines/scenes/scene.hpp"
#include "services/lab/measures/replay.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::lab {

/// How a scene is run. Zero `users` stands for the scene's own number.
struct SceneRun {
  std::uint32_t bodies = 0;
  std::uint64_t seed = 1;
  std::uint32_t threads = 1;
  std::uint32_t users = 0;
  std::uint64_t frames = 0;
};

/// A simulation at frame 0, and its inputs.
struct Source {
  std::unique_ptr<engine::Simulation> simulation;
  std::vector<TimedInput> script;
};

/// Errors: as scenes::make_simulation().
[[nodiscard]] Result<Source> make_source(const scenes::Scene& scene, const SceneRun& run);

}  // namespace tandem::lab
