// `bench_lab train`: writes next to a scene's file what the thesis's codecs need to know about the scene.

#include <fmt/format.h>

#include <memory>
#include <utility>

#include "services/follow/recording/output_file.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/train.hpp"
#include "services/program/json/json.hpp"
#include "services/tool/progress.hpp"
#include "tests/bench/lab/commands.hpp"
#include "tests/bench/lab/trained_text.hpp"

namespace tandem::lab {
namespace {

// This is far from the seeds of measurements, so that no measurement uses a run that was trained on.
constexpr std::uint64_t kTrainingSeed = 1001;

struct TrainOptions {
  std::vector<std::string> scenes;
  std::vector<std::uint32_t> bodies{5000, 10000, 20000};
  std::uint64_t frames = 1000;
  sessions::SessionChoice choice;
  SceneRun run;
  bool json = false;
};

Result<scenes::TrainedTable> train_scene(const scenes::Scene& scene, const TrainOptions& options,
                                         std::uint32_t bodies) {
  SceneRun run = options.run;
  run.bodies = bodies;
  run.frames = options.frames;
  sessions::SessionChoice choice = options.choice;
  choice.bodies = bodies;
  tool::Progress progress(fmt::format("{}, {} bodies: training, frame", scene.name, bodies),
                          kTrainingPasses * options.frames);
  return train(
      scene, choice, [&] { return make_source(scene, run); }, options.frames,
      [&](Frame frame) { progress.at(frame); });
}

Result<void> write(const std::string& path, const std::string& text) {
  return recording::OutputFile::create(path, recording::Existing::kReplaced)
      .and_then([&](recording::OutputFile&& file) {
        return file.write(std::as_bytes(std::span(text))).and_then([&] { return file.commit(); });
      });
}

int run_train(const TrainOptions& options) {
  const auto scenes = load_scenes(options.scenes);
  if (!scenes) return refuse("train", scenes.error());
  Json rows = Json::array();
  for (const scenes::Scene& scene : *scenes) {
    auto tables = scenes::load_trained(scene.path);  // those of other sizes and thresholds stay
    if (!tables) return refuse("train", tables.error());
    for (const std::uint32_t bodies : options.bodies) {
      auto table = train_scene(scene, options, bodies);
      if (!table) return refuse("train", table.error());
      if (!options.json) {
        fmt::print(
            "{:<12} {:>7} bodies  threshold {:.4f}  position range {:.5f}  velocity range {:.5f}  -> {}\n",
            scene.name, bodies, table->threshold_m, table->position_range_m, table->velocity_range_m_per_s,
            scenes::trained_path(scene.path));
      }
      rows.push_back({{"scene", scene.name},
                      {"bodies", bodies},
                      {"threshold", table->threshold_m},
                      {"position_range", table->position_range_m},
                      {"velocity_range", table->velocity_range_m_per_s},
                      {"file", scenes::trained_path(scene.path)}});
      put(*tables, std::move(*table));
    }
    if (const auto written = write(scenes::trained_path(scene.path), trained_text(*tables)); !written)
      return refuse("train", written.error());
  }
  if (options.json) fmt::print("{}\n", Json{{"rows", rows}}.dump());
  return 0;
}

}  // namespace

void add_train(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "train",
      "Writes quantisation ranges and code lengths beside the scene file, in place of those of the same size and threshold: NAME.trained.textproto.");
  const auto options = std::make_shared<TrainOptions>();
  options->run.seed = kTrainingSeed;
  add_scene_option(command, options->scenes);
  add_bodies_option(command, options->bodies);
  command.add_option("--frames", options->frames, "Number of frames from the start block on")
      .range(std::uint64_t{1}, kMaxFrames)
      .show_default();
  add_seed_option(command, options->run.seed, "Seed of the training run");
  add_threshold_options(command, options->choice);
  command.add_option("--threads", options->run.threads, "Threads of the engine")
      .range(1U, kMaxThreads)
      .show_default();
  command.add_flag("--json", options->json,
                   "Print one JSON object: rows[scene, bodies, threshold, ranges, file]");
  command.on_chosen([options, &run] { run = [options] { return run_train(*options); }; });
}

}  // namespace tandem::lab
