#include "services/tandemd/configuration/rehearsal.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "sdk/transport/dds/dds_ports.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/checkpoint/disk.hpp"
#include "services/host/planning/plan.hpp"
#include "services/program/metrics/endpoint.hpp"

namespace tandem::daemon {
namespace {

Result<scenes::Scene> scene_of(const DaemonOptions& options) {
  auto scene = scenes::load_scene(options.scene);
  if (!scene) return tl::unexpected(placed(options.places, "scene", scene.error()));
  return scene;
}

/// Errors as a start has them, which opens a file for writing.
Result<void> check_writable(const std::string& path) {
  if (path.empty() || ::access(path.c_str(), W_OK) == 0) return {};
  const std::string parent = std::filesystem::path(path).parent_path().string();
  if (errno == ENOENT && ::access(parent.empty() ? "." : parent.c_str(), W_OK | X_OK) == 0) return {};
  return fail(ErrorCode::kIo, path + ": cannot be written: " + std::strerror(errno));
}

/// What the configuration names of this machine.
Result<void> check_machine(const DaemonOptions& options) {
  const auto placed_at = [&options](const char* field) {
    return [&options, field](const Error& error) { return placed(options.places, field, error); };
  };
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  const auto good_folder = [&options] {
    const std::string& folder = options.checkpoint.folder;
    return folder.empty() ? Result<void>() : checkpoint::check_folder(folder);
  };
  const auto good_metrics = [&options] {
    return options.metrics ? metrics::check_address(*options.metrics) : Result<void>();
  };
  return transport::check_dds_profile(dds)
      .map_error(placed_at("profile"))
      .and_then([&] { return good_folder().map_error(placed_at("checkpoint_dir")); })
      .and_then([&] { return good_metrics().map_error(placed_at("metrics")); })
      .and_then([&] { return check_writable(options.hash_log).map_error(placed_at("hash_log")); });
}

}  // namespace

Result<void> check_scene(const DaemonOptions& options) {
  if (options.engine) return {};
  return scene_of(options).map([](const scenes::Scene& /*scene*/) {});
}

Result<void> check_identity(const DaemonOptions& options) {
  transport::DdsOptions dds;
  dds.secure = options.secure;
  if (auto good = transport::check_dds_identity(dds); !good)
    return tl::unexpected(placed(options.places, "secure", good.error()));
  return {};
}

Result<void> rehearse(const DaemonOptions& options) {
  if (auto good = check_identity(options); !good) return good;
  if (auto good = check_machine(options); !good) return good;
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
