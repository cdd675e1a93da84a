// `tandem bench client`: what a client costs, beside the full simulation that it is spared.

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "services/lab/bench.hpp"
#include "services/lab/client_cost.hpp"

namespace tandem::lab {
namespace {

constexpr const char* kCommand = "bench client";

struct ClientOptions {
  std::string scene = "half_pipe";
  std::vector<std::string> predictors{"ballistic", "contact", "field"};
  std::vector<std::string> codecs;
  ClientCostSetup setup;
  bool json = false;
};

nlohmann::ordered_json to_json(const Cost& cost) {
  return {{"p50", cost.p50}, {"p99", cost.p99}, {"p999", cost.p999}};
}

int run_client(const ClientOptions& options) {
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return report(kCommand, scene.error());
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  if (!options.json) {
    fmt::print("{} with {} bodies, lead 1; ms of one core, median and 99th percentile\n", scene->name,
               options.setup.choice.bodies);
    fmt::print("{:<10} {:<10} {:>9} {:>15} {:>15} {:>15} {:>15} {:>15} {:>17}\n", "predictor", "codec",
               "corrected", "engine's step", "client's frame", "predicted step", "when sampled", "sample",
               "beside, to p99.9");
  }
  for (const std::string& predictor : options.predictors) {
    for (const std::string& codec : options.codecs) {
      ClientCostSetup setup = options.setup;
      setup.choice.predictor = predictor;
      setup.choice.codec = codec;
      const auto row = measure_client_cost(*scene, setup);
      if (!row) return report(kCommand, row.error());
      rows.push_back({{"scene", row->scene},
                      {"predictor", row->predictor},
                      {"codec", row->codec},
                      {"bodies", row->bodies},
                      {"frames", row->frames},
                      {"corrected_per_frame", row->corrected_per_frame},
                      {"engine_ms", to_json(row->engine)},
                      {"frame_ms", to_json(row->frame)},
                      {"predicted_ms", to_json(row->predicted)},
                      {"sampled_frame_ms", to_json(row->sampled_frame)},
                      {"sample_ms", to_json(row->sample)},
                      {"sample_beside_ms", to_json(row->beside)}});
      if (options.json) continue;
      const auto two = [](const Cost& cost) { return fmt::format("{:7.3f} {:7.3f}", cost.p50, cost.p99); };
      fmt::print("{:<10} {:<10} {:>9.0f} {} {} {} {} {} {:8.3f} {:8.3f}\n", row->predictor, row->codec,
                 row->corrected_per_frame, two(row->engine), two(row->frame), two(row->predicted),
                 two(row->sampled_frame), two(row->sample), row->beside.p50, row->beside.p999);
      std::fflush(stdout);
    }
  }
  if (options.json) fmt::print("{}\n", nlohmann::ordered_json{{"rows", rows}}.dump());
  return 0;
}

}  // namespace

void add_client(CLI::App& bench, Run& run) {
  CLI::App* command = bench.add_subcommand(
      "client", "Time that a client takes a frame and a sample, beside the full simulation's step.");
  const auto options = std::make_shared<ClientOptions>();
  for (const std::string_view name : codec_names()) options->codecs.emplace_back(name);
  options->setup.choice.bodies = 10000;
  command->add_option("--scene", options->scene, "Scene by name or file")->capture_default_str();
  command->add_option("--bodies", options->setup.choice.bodies, "Number of bodies")
      ->check(CLI::Range(1U, engine::kMaxBodies))
      ->capture_default_str();
  command->add_option("--predictor", options->predictors, "Predicted steps, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember({"ballistic", "contact", "field"}))
      ->capture_default_str();
  command->add_option("--codec", options->codecs, "Codecs, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(std::vector<std::string>(options->codecs)))
      ->capture_default_str();
  add_threshold_options(*command, options->setup.choice);
  add_seed_option(*command, options->setup.seed, "Of the start block, the scripted inputs and the network");
  command->add_option("--frames", options->setup.frames, "Measured for each row")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_flag("--json", options->json,
                    "One JSON object: rows[scene, predictor, codec, bodies, frames, corrected_per_frame, "
                    "engine_ms, frame_ms, predicted_ms, sampled_frame_ms, sample_ms, sample_beside_ms]");
  command->footer(
      "In one process, the network in memory. Client's frame: taking what came, the predicted step, decoding,\n"
      "applying, checking the hash. Sample: positions, velocities, alive and types of all bodies; beside: in a\n"
      "thread of its own while another one applies, by the wall clock.");
  command->callback([options, &run] { run = [options] { return run_client(*options); }; });
}

}  // namespace tandem::lab
