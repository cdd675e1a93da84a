#include "services/tandemd/configuration/rehearsal.hpp"

#include "sdk/transport/clock.hpp"
#include "sdk/transport/secure/identity_folder.hpp"
#include "sdk/transport/units.hpp"
#include "services/planning/plan.hpp"
#include "services/scenes/scene.hpp"
#include "services/sessions/session_plan.hpp"

namespace tandem::daemon {
namespace {

Result<scenes::Scene> scene_of(const Options& options) {
  auto scene = scenes::load_scene(options.scene);
  if (!scene) return tl::unexpected(placed(options.places, "scene", scene.error()));
  return scene;
}

}  // namespace

Result<void> check_scene(const Options& options) {
  if (options.engine) return {};
  return scene_of(options).map([](const scenes::Scene& /*scene*/) {});
}

Result<void> check_identity(const Options& options) {
  if (options.secure.empty()) return {};
  const auto identity =
      transport::secure::check_identity_folder(options.secure, transport::wall_ns() / kSecond);
  if (!identity) return tl::unexpected(placed(options.places, "secure", identity.error()));
  return {};
}

Result<void> rehearse(const Options& options) {
  if (auto good = check_identity(options); !good) return good;
  if (options.engine) return {};  // it says what it simulates when it comes
  const auto scene = scene_of(options);
  if (!scene) return tl::unexpected(scene.error());
  const auto config = planning::plan_server(sessions::world_of(*scene, options.choice.bodies),
                                            static_cast<const planning::Wishes&>(options.choice), options);
  if (!config) return tl::unexpected(placed(options.places, "", config.error()));
  const auto simulation =
      scenes::make_simulation(*scene, options.choice.bodies, options.seed, options.choice.threads);
  if (!simulation) return tl::unexpected(placed(options.places, "bodies", simulation.error()));
  return {};
}

}  // namespace tandem::daemon
