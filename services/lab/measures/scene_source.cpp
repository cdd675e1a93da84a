#include "services/lab/measures/scene_source.hpp"

#include <utility>

namespace tandem::lab {

Result<Source> make_source(const scenes::Scene& scene, const SceneRun& run) {
  auto simulation = scenes::make_simulation(scene, run.bodies, run.seed, run.threads);
  if (!simulation) return tl::unexpected(simulation.error());
  Source source{std::move(*simulation), {}};
  for (auto& scripted : scenes::scripted_inputs(scene, run.seed, run.users, run.frames)) {
    source.script.push_back({scripted.frame, std::move(scripted.input)});
  }
  return source;
}

}  // namespace tandem::lab
