// `bench_lab memory`: bytes that engine, server and client hold, in total and per slot.

#include <fmt/format.h>

#include <memory>

#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/commands.hpp"
#include "tests/bench/lab/memory.hpp"

namespace tandem::lab {
namespace {

struct MemoryOptions {
  std::string scene = "half_pipe";
  std::uint32_t bodies = 10000;
  std::string codec = "entropy";
  std::uint64_t frames = 60;
  bool json = false;
};

Result<HostedSimulation> host_scene(const scenes::Scene& scene, const MemoryOptions& options,
                                    std::uint32_t bodies) {
  sessions::SessionChoice choice;
  choice.bodies = bodies;
  choice.codec = options.codec;
  auto session = sessions::plan_session(scene, choice);
  if (!session) return tl::unexpected(session.error());
  SceneRun run;
  run.bodies = bodies;
  return make_source(scene, run).map([&](Source&& source) {
    return HostedSimulation{std::move(source.simulation), std::move(*session)};
  });
}

int run_memory(const MemoryOptions& options) {
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return refuse("memory", scene.error());
  const struct {
    const char* name;
    std::int64_t MemoryUse::*bytes;
  } parts[] = {{"engine", &MemoryUse::engine_bytes},
               {"server", &MemoryUse::server_bytes},
               {"client", &MemoryUse::client_bytes}};
  Json rows = Json::array();
  if (!options.json) fmt::print("{:>8} {:<8} {:>14} {:>14}\n", "bodies", "", "total bytes", "bytes a slot");
  // Prints two sizes separately, because scratch may grow in steps, and a line through both would be
  // misleading.
  for (const std::uint32_t bodies : {options.bodies, 2 * options.bodies}) {
    const auto use = measure_memory([&] { return host_scene(*scene, options, bodies); }, options.frames);
    if (!use) return refuse("memory", use.error());
    Json row{{"scene", scene->name}, {"bodies", bodies}, {"codec", options.codec}};
    for (const auto& part : parts) {
      const std::int64_t total = (*use).*part.bytes;
      const double a_slot = static_cast<double>(total) / bodies;
      row[part.name] = {{"total_bytes", total}, {"slot_bytes", a_slot}};
      if (!options.json) fmt::print("{:>8} {:<8} {:>14} {:>14.1f}\n", bodies, part.name, total, a_slot);
    }
    rows.push_back(std::move(row));
  }
  if (options.json) fmt::print("{}\n", Json{{"rows", rows}}.dump());
  return 0;
}

}  // namespace

void add_memory(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "memory", "Measures the heap of engine, server and client while playing, without DDS.");
  const auto options = std::make_shared<MemoryOptions>();
  command.add_option("--scene", options->scene, "Scene by name or file").show_default();
  command.add_option("--bodies", options->bodies, "Number of bodies; twice that number is measured, too")
      .range(1U, engine::kMaxBodies / 2)
      .show_default();
  command.add_option("--codec", options->codec, "Codec").one_of(codec_choices()).show_default();
  command.add_option("--frames", options->frames, "Number of frames to play").range(1, 100000).show_default();
  command.add_flag("--json", options->json,
                   "Print one JSON object: rows[scene, bodies, codec, engine, server, client]");
  command.on_chosen([options, &run] { run = [options] { return run_memory(*options); }; });
}

}  // namespace tandem::lab
