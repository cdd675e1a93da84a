#pragma once
// What a server simulates: a scene with the engine linked in, or an engine in another process.

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "services/engines/door/door.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/host/planning/world.hpp"
#include "services/tandemd/configuration/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

struct ServedWorld {
  planning::PlannedWorld world;
  std::string session;                 ///< the name that the engine wishes; empty: none
  std::string engine;                  ///< its name, as checkpoints keep it
  std::optional<scenes::Scene> scene;  ///< empty: an engine in another process
  std::unique_ptr<engine::Simulation> simulation;
  engine::door::Door* door = nullptr;  ///< the simulation, if it is an engine in another process
};

/// A failure of open_world().
struct NotOpened {
  Error error;
  std::string field;  ///< of the configuration; empty: none
  int exit_code = 2;
};

/// Loads the scene, or waits for the engine; `stop` ends the wait, and `idle` is called meanwhile, and later
/// as engine::door::DoorOptions says.
[[nodiscard]] tl::expected<ServedWorld, NotOpened> open_world(const DaemonOptions& options,
                                                              const std::atomic<bool>& stop,
                                                              const std::function<void(bool)>& idle);

/// What the planner needs to know of an engine that said `hello`.
[[nodiscard]] planning::PlannedWorld world_of(const engine::door::Hello& hello);

}  // namespace tandem::daemon
