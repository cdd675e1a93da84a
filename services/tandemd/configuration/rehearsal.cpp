#include "services/tandemd/configuration/rehearsal.hpp"

#include "services/planning/plan.hpp"
#include "services/scenes/scene.hpp"
#include "services/sessions/session_plan.hpp"

namespace tandem::daemon {

Result<void> rehearse(const Options& options) {
  if (options.engine) return {};  // it says what it simulates when it comes
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return tl::unexpected(placed(options.places, "scene", scene.error()));
  const auto config = planning::plan_server(sessions::world_of(*scene, options.choice.bodies),
                                            static_cast<const planning::Wishes&>(options.choice), options);
  if (!config) return tl::unexpected(placed(options.places, "", config.error()));
  const auto simulation =
      scenes::make_simulation(*scene, options.choice.bodies, options.seed, options.choice.threads);
  if (!simulation) return tl::unexpected(placed(options.places, "bodies", simulation.error()));
  return {};
}

}  // namespace tandem::daemon
