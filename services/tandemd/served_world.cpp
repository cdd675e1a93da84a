#include "services/tandemd/served_world.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "services/engines/background/background.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/planning/scenery_json.hpp"

namespace tandem::daemon {
namespace {

using engine::door::Hello;

// As share of the smallest radius; an engine that wants another one says so.
constexpr double kThresholdShare = 0.02;
constexpr double kExtent = 100;  // scene units

tl::unexpected<NotOpened> refuse(Error error, std::string field, int exit_code) {
  return tl::unexpected(NotOpened{std::move(error), std::move(field), exit_code});
}

tl::expected<ServedWorld, NotOpened> wait_for_engine(const DaemonOptions& options,
                                                     const std::atomic<bool>& stop,
                                                     const std::function<void(bool)>& idle) {
  engine::door::DoorOptions door{.way = *options.engine};
  door.stop = &stop;
  door.idle = idle;
  door.log = [](const std::string& line, bool warning) {
    spdlog::log(warning ? spdlog::level::warn : spdlog::level::info, line);
  };
  auto opened = engine::door::Door::open(std::move(door));
  if (!opened) return refuse(opened.error(), "", 1);
  const Hello& hello = (*opened)->hello();
  if (!hello.saves && options.standby) {
    const std::string why = fmt::format(
        "the engine {} does not save (its HELLO has no `save 1`), so no server of it can stand by",
        hello.name);
    (*opened)->dismiss(why);
    return refuse({ErrorCode::kUnsupported, why}, "standby", 2);
  }
  if (!hello.saves)
    spdlog::warn(
        "the engine {} does not save (its HELLO has no `save 1`): whenever it ends, the world begins anew at frame 0, and no "
        "server can stand by",
        hello.name);
  for (const std::string& line : hello.ignored)
    spdlog::warn("the engine's line `{}` is ignored, as this server does not know its key", line);
  spdlog::info("engine {}, process {}: {} slots, {:g} s a step", hello.name, (*opened)->engine_process(),
               hello.capacity, hello.dt_s);
  engine::door::Door* const there = opened->get();
  return ServedWorld{.world = world_of(hello),
                     .session = hello.session,
                     .engine = "door:" + hello.name,
                     .scene = std::nullopt,
                     .simulation = std::move(*opened),
                     .door = there};
}

}  // namespace

planning::PlannedWorld world_of(const Hello& hello) {
  planning::PlannedWorld world;
  world.name = hello.scene.empty() ? hello.name : hello.scene;
  world.scene_json = planning::scenery_json(hello.scenery, hello.dt_s);
  world.capacity = hello.capacity;
  world.dt_s = hello.dt_s;
  world.turns = hello.turns;
  world.tells = {.keys = hello.tells.keys, .events = hello.tells.events};
  world.up_axis = static_cast<transport::UpAxis>(hello.up_axis);
  double smallest = hello.types.front().radius;
  for (const engine::door::BodyType& type : hello.types) {
    smallest = std::min(smallest, type.radius);
    world.types.push_back({.name = type.name,
                           .bounding_radius = type.radius,
                           .contact_radius = type.radius,
                           .mass = type.mass,
                           .colour_rgba = type.colour_rgba,
                           .shape = type.shape,
                           .shape_values = type.shape_values});
  }
  world.threshold = hello.threshold.value_or(kThresholdShare * smallest);
  // The lattice reaches about a million thresholds.
  world.extent = hello.extent.value_or(std::min(kExtent, 2e5 * world.threshold));
  if (hello.has_law) world.scenery = hello.scenery;
  return world;
}

tl::expected<ServedWorld, NotOpened> open_world(const DaemonOptions& options, const std::atomic<bool>& stop,
                                                const std::function<void(bool)>& idle) {
  if (options.engine) return wait_for_engine(options, stop, idle);
  auto scene = scenes::load_scene(options.scene);
  if (!scene) return refuse(scene.error(), "scene", 2);
  auto simulation =
      scenes::make_simulation(*scene, options.choice.bodies, options.seed, options.choice.threads);
  if (!simulation) return refuse(simulation.error(), "bodies", 2);
  if (options.pipeline) {
    simulation = engine::step_in_background(std::move(*simulation));
    if (!simulation) return refuse(simulation.error(), "pipeline", 1);
  }
  ServedWorld served{.world = sessions::world_of(*scene, options.choice.bodies),
                     .session = {},
                     .engine = scene->engine == scenes::EngineKind::kBullet ? "bullet" : "particles",
                     .scene = std::nullopt,
                     .simulation = std::move(*simulation)};
  served.scene = std::move(*scene);
  return served;
}

}  // namespace tandem::daemon
