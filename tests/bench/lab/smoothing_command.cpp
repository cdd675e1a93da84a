// `bench_lab smoothing`: how far what is drawn jumps, with and without smoothing.

#include <fmt/format.h>

#include <memory>

#include "sdk/core/tables/predictor_table.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/commands.hpp"
#include "tests/bench/lab/smoothing.hpp"

namespace tandem::lab {
namespace {

constexpr const char* kCommand = "smoothing";

struct SmoothingOptions {
  std::vector<std::string> scenes{"all"};
  std::vector<std::string> predictors = predictor_names();
  SmoothingSetup setup;
  bool json = false;
};

Json to_json(const Seen& seen) {
  return {{"jump_p999", seen.jump}, {"mean_error", seen.mean_error}, {"p999_error", seen.p999_error}};
}

int run_smoothing(const SmoothingOptions& options) {
  const auto scenes = load_scenes(options.scenes);
  if (!scenes) return refuse(kCommand, scenes.error());
  Json rows = Json::array();
  if (!options.json) {
    fmt::print("{:<12} {:<10} {:>9}   {:>10} {:>10} {:>6}   {:>10} {:>10} {:>10}\n", "scene", "predictor",
               "threshold", "jump p99.9", "unsmoothed", "ratio", "mean error", "unsmoothed", "p99.9");
  }
  for (const scenes::Scene& scene : *scenes) {
    for (const std::string& predictor : options.predictors) {
      SmoothingSetup setup = options.setup;
      setup.choice.predictor = predictor;
      const auto row = measure_smoothing(scene, setup);
      if (!row) return refuse(kCommand, row.error());
      const double ratio = row->unsmoothed.jump / row->smoothed.jump;
      rows.push_back({{"scene", row->scene},
                      {"predictor", row->predictor},
                      {"codec", row->codec},
                      {"bodies", row->bodies},
                      {"threshold", row->threshold},
                      {"samples", row->samples},
                      {"smoothed", to_json(row->smoothed)},
                      {"unsmoothed", to_json(row->unsmoothed)}});
      if (options.json) continue;
      fmt::print("{:<12} {:<10} {:>9.4f}   {:>10.6f} {:>10.6f} {:>6.1f}   {:>10.6f} {:>10.6f} {:>10.6f}\n",
                 row->scene, row->predictor, row->threshold, row->smoothed.jump, row->unsmoothed.jump, ratio,
                 row->smoothed.mean_error, row->unsmoothed.mean_error, row->smoothed.p999_error);
      std::fflush(stdout);
    }
  }
  if (options.json) fmt::print("{}\n", Json{{"rows", rows}}.dump());
  return 0;
}

}  // namespace

void add_smoothing(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "smoothing",
      "Measures how visible corrections are: two clients sample one session, one of them with smoothing.");
  const auto options = std::make_shared<SmoothingOptions>();
  SmoothingSetup& setup = options->setup;
  setup.choice.bodies = 1000;
  command
      .add_option("--scene", options->scenes,
                  "Scenes by name or file, separated by commas; all for the thesis's five")
      .separated_by(',')
      .show_default();
  command.add_option("--predictor", options->predictors, "Predicted steps, separated by commas")
      .separated_by(',')
      .one_of(predictor_names())
      .show_default();
  command.add_option("--codec", setup.choice.codec, "Codec").one_of(codec_choices()).show_default();
  command.add_option("--bodies", setup.choice.bodies, "Number of bodies")
      .range(1U, engine::kMaxBodies)
      .show_default();
  add_threshold_options(command, setup.choice);
  add_seed_option(command, setup.seed, "Seed of the start block, the scripted inputs and the network");
  command.add_option("--seconds", setup.seconds, "Seconds of simulated time for each row")
      .range(0.1, 3600.0)
      .show_default();
  command.add_option("--rate", setup.rate_hz, "Samples per second").range(1.0, 1000.0).show_default();
  command
      .add_option("--smoothing", setup.smoothing_s,
                  "Time constant of the smoothed client, in s (default: the client's own)")
      .range(0.0, 10.0);
  command.add_option("--delay", setup.delay_ms, "Delay of the network each way, in ms")
      .range(0.0, 1000.0)
      .show_default();
  command.add_option("--jitter", setup.jitter_ms, "Maximum extra delay in ms, evenly distributed from 0")
      .range(0.0, 1000.0)
      .show_default();
  command.add_option("--outage", setup.outage_s, "Seconds of every five for which the link is cut")
      .range(0.0, 4.0)
      .show_default();
  command.add_flag(
      "--json", options->json,
      "Print one JSON object: rows[scene, predictor, codec, bodies, threshold, samples, smoothed, "
      "unsmoothed]");
  command.footer(
      "Jump compares the second differences of the places shown with those of the full simulation at the "
      "same\n"
      "moments: it is the 99.9th percentile of the excess over bodies and samples, in scene units.");
  command.on_chosen([options, &run] { run = [options] { return run_smoothing(*options); }; });
}

}  // namespace tandem::lab
