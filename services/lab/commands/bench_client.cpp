// `tandem bench client`: what the client's code costs on this device, next to the full simulation, which a
// client need not run.

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "sdk/core/tables/predictor_table.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/client_cost.hpp"
#include "services/program/json/json.hpp"

namespace tandem::lab {
namespace {

struct ClientOptions {
  std::string scene = "half_pipe";
  std::vector<std::uint32_t> bodies{10000};
  std::vector<std::string> predictors = predictor_names();
  std::vector<std::string> codecs = codec_choices();
  ClientCostSetup setup;
  bool json = false;
};

Json to_json(const Cost& cost) { return {{"p50", cost.p50}, {"p99", cost.p99}, {"p999", cost.p999}}; }

Json to_json(const ClientCostRow& row) {
  return {{"scene", row.scene},
          {"predictor", row.predictor},
          {"codec", row.codec},
          {"bodies", row.bodies},
          {"frames", row.frames},
          {"corrected_per_frame", row.corrected_per_frame},
          {"engine_ms", to_json(row.engine)},
          {"frame_ms", to_json(row.frame)},
          {"predicted_ms", to_json(row.predicted)},
          {"sampled_frame_ms", to_json(row.sampled_frame)},
          {"sample_ms", to_json(row.sample)},
          {"sample_beside_ms", to_json(row.beside)}};
}

void print_heading(const std::string& scene) {
  fmt::print("{}, lead 1; ms of one core, median and 99th percentile\n", scene);
  fmt::print("{:>7} {:<10} {:<10} {:>9} {:>15} {:>15} {:>15} {:>15} {:>15} {:>17}\n", "bodies", "predictor",
             "codec", "corrected", "engine's step", "client's frame", "predicted step", "when sampled",
             "sample", "beside, to p99.9");
}

void print(const ClientCostRow& row) {
  const auto two = [](const Cost& cost) { return fmt::format("{:7.3f} {:7.3f}", cost.p50, cost.p99); };
  fmt::print("{:>7} {:<10} {:<10} {:>9.0f} {} {} {} {} {} {:8.3f} {:8.3f}\n", row.bodies, row.predictor,
             row.codec, row.corrected_per_frame, two(row.engine), two(row.frame), two(row.predicted),
             two(row.sampled_frame), two(row.sample), row.beside.p50, row.beside.p999);
}

int run_client(ClientOptions options) {
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return report("bench client", scene.error());
  Json rows = Json::array();
  if (!options.json) print_heading(scene->name);
  for (const std::uint32_t bodies : options.bodies) {
    options.setup.choice.bodies = bodies;
    for (const std::string& predictor : options.predictors) {
      options.setup.choice.predictor = predictor;
      for (const std::string& codec : options.codecs) {
        options.setup.choice.codec = codec;
        const auto row = measure_client_cost(*scene, options.setup);
        if (!row) return report("bench client", row.error());
        rows.push_back(to_json(*row));
        if (!options.json) print(*row);
        std::fflush(stdout);
      }
    }
  }
  if (options.json) fmt::print("{}\n", Json{{"rows", rows}}.dump());
  return 0;
}

}  // namespace

void add_client(commandline::Command bench, Run& run) {
  commandline::Command command = bench.add_subcommand(
      "client", "Measures what a client costs per frame, next to the full simulation's step.");
  const auto options = std::make_shared<ClientOptions>();
  command.add_option("--scene", options->scene, "Scene by name or file").show_default();
  add_bodies_option(command, options->bodies);
  command.add_option("--predictor", options->predictors, "Predicted steps, separated by commas")
      .separated_by(',')
      .one_of(predictor_names())
      .show_default();
  command.add_option("--codec", options->codecs, "Codecs, separated by commas")
      .separated_by(',')
      .one_of(codec_choices())
      .show_default();
  add_threshold_options(command, options->setup.choice);
  add_seed_option(command, options->setup.seed,
                  "Seed of the start block, the scripted inputs and the network");
  command.add_option("--frames", options->setup.frames, "Number of frames to measure for each row")
      .range(1, 100000)
      .show_default();
  command.add_flag(
      "--json", options->json,
      "Print one JSON object: rows[scene, predictor, codec, bodies, frames, corrected_per_frame, "
      "engine_ms, frame_ms, predicted_ms, sampled_frame_ms, sample_ms, sample_beside_ms]");
  command.footer(
      "All runs in one process and in simulated time, without DDS. Times are in ms on one core. A frame\n"
      "consists of receiving, the predicted step, decoding, applying and checking the hash; a sample, of\n"
      "positions, velocities, alive and types of all bodies; beside means a sample in a thread of its own\n"
      "while another one applies, by the wall clock.");
  command.on_chosen([options, &run] { run = [options] { return run_client(*options); }; });
}

}  // namespace tandem::lab
