// `bench_lab engine`: how often the full simulation alone can be updated on this machine.

#include <fmt/format.h>

#include <memory>

#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/commands.hpp"

namespace tandem::lab {
namespace {

struct EngineOptions {
  std::string scene = "half_pipe";
  SceneRun run{.bodies = 10000, .frames = 1'000'000};
  double seconds = 3;
  bool json = false;
};

int run_engine(const EngineOptions& options) {
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return refuse("engine", scene.error());
  auto source = make_source(*scene, options.run);
  if (!source) return refuse("engine", source.error());
  std::uint64_t frames = 0;
  std::size_t next = 0;
  const std::int64_t start_ns = steady_ns();
  double elapsed_s = 0;
  for (; elapsed_s < options.seconds; elapsed_s = static_cast<double>(steady_ns() - start_ns) * 1e-9) {
    ++frames;
    for (; next < source->script.size() && source->script[next].frame <= frames; ++next) {
      source->simulation->apply(source->script[next].input);
    }
    source->simulation->step();
  }
  const double updates_per_s = static_cast<double>(frames) / elapsed_s;
  if (options.json) {
    fmt::print("{}\n", Json{{"scene", scene->name},
                            {"bodies", options.run.bodies},
                            {"threads", options.run.threads},
                            {"frames", frames},
                            {"seconds", elapsed_s},
                            {"updates_per_s", updates_per_s}}
                           .dump());
  } else {
    fmt::print("{} with {} bodies on {} threads: {:.1f} updates/s ({} in {:.1f} s)\n", scene->name,
               options.run.bodies, options.run.threads, updates_per_s, frames, elapsed_s);
  }
  return 0;
}

}  // namespace

void add_engine(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "engine", "Runs the full simulation alone, with its scripted users, as fast as possible.");
  const auto options = std::make_shared<EngineOptions>();
  command.add_option("--scene", options->scene, "Scene by name or file").show_default();
  command.add_option("--bodies", options->run.bodies, "Number of bodies")
      .range(1U, engine::kMaxBodies)
      .show_default();
  command.add_option("--threads", options->run.threads, "Threads of the engine")
      .range(1U, kMaxThreads)
      .show_default();
  add_seed_option(command, options->run.seed, "Seed of the start block and the scripted inputs");
  command.add_option("--seconds", options->seconds, "Seconds to run").range(0.01, 3600.0).show_default();
  command.add_flag("--json", options->json, "Print one JSON object");
  command.on_chosen([options, &run] { run = [options] { return run_engine(*options); }; });
}

}  // namespace tandem::lab
