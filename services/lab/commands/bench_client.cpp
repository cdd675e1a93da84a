// `tandem bench client`: the cost of a client, next to that of the full simulation, which a client need not
// run.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/child.hpp"
#include "services/lab/measures/client_cost.hpp"
#include "services/lab/measures/client_process.hpp"
#include "services/program/json/json.hpp"

namespace tandem::lab {
namespace {

struct ClientOptions {
  std::string scene = "half_pipe";
  std::vector<std::uint32_t> bodies{10000};
  std::vector<std::string> predictors = predictor_names();
  std::vector<std::string> codecs;
  ClientProcessSetup process;
  std::uint64_t frames = 300;
  bool in_memory = false, json = false;
};

Json to_json(const Cost& cost) { return {{"p50", cost.p50}, {"p99", cost.p99}, {"p999", cost.p999}}; }

// The row of a client in memory.

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

void print_cost_heading() {
  fmt::print("lead 1; ms of one core, median and 99th percentile\n");
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

// The row of clients as processes.

Json to_json(const ClientProcessSetup& setup, const ClientProcessRow& row, double engine_ms) {
  return {{"scene", setup.scene},
          {"predictor", setup.choice.predictor},
          {"codec", setup.choice.codec},
          {"bodies", setup.choice.bodies},
          {"runs", setup.runs},
          {"seconds", setup.seconds},
          {"frames_per_s", row.frames_per_s},
          {"engine_ms", engine_ms},
          {"cpu_ms", {{"median", row.cpu_ms}, {"least", row.cpu_ms_least}, {"most", row.cpu_ms_most}}},
          {"kind_ms", row.by_kind},
          {"thread_ms", row.by_thread},
          {"syscalls", row.syscalls ? Json(*row.syscalls) : Json(nullptr)},
          {"wakeups_per_s", row.wakeups_per_s},
          {"idle_wakeups_per_s", row.idle_wakeups_per_s},
          {"resident_mb", row.resident_mb}};
}

constexpr const char* kKinds[] = {"receive", "predict", "decode", "hash", "acknowledge", "dds"};

void print_process_heading() {
  fmt::print("{:>7} {:<10} {:<10} {:>7} {:>8} {:>15}", "bodies", "predictor", "codec", "engine", "client",
             "least to most");
  for (const char* kind : kKinds) fmt::print(" {:>8}", std::string_view(kind).substr(0, 8));
  fmt::print(" {:>8} {:>8} {:>7} {:>8}  {}\n", "syscalls", "wakes/s", "idle/s", "MB", "by thread");
}

void print(const ClientProcessSetup& setup, const ClientProcessRow& row, double engine_ms) {
  fmt::print("{:>7} {:<10} {:<10} {:>7.3f} {:>8.3f} {:>6.3f} to {:>5.3f}", setup.choice.bodies,
             setup.choice.predictor, setup.choice.codec, engine_ms, row.cpu_ms, row.cpu_ms_least,
             row.cpu_ms_most);
  for (const char* kind : kKinds) fmt::print(" {:>8.3f}", row.by_kind.at(kind));
  fmt::print(" {:>8} {:>8.0f} {:>7.1f} {:>8.1f} ", row.syscalls ? fmt::format("{:.1f}", *row.syscalls) : "-",
             row.wakeups_per_s, row.idle_wakeups_per_s, row.resident_mb);
  std::vector<std::pair<double, std::string>> threads;
  for (const auto& [name, ms] : row.by_thread) threads.emplace_back(ms, name);
  std::sort(threads.rbegin(), threads.rend());
  for (const auto& [ms, name] : threads) {
    if (ms >= 0.0005) fmt::print(" {} {:.3f}", name, ms);
  }
  fmt::print("\n");
}

Result<Json> measure(const ClientOptions& options, const scenes::Scene& scene,
                     const ClientProcessSetup& setup, double engine_ms) {
  if (options.in_memory) {
    const auto row =
        measure_client_cost(scene, {.choice = setup.choice, .seed = setup.seed, .frames = options.frames});
    if (!row) return tl::unexpected(row.error());
    if (!options.json) print(*row);
    return to_json(*row);
  }
  const auto row = measure_client_process(setup);
  if (!row) return tl::unexpected(row.error());
  if (!options.json) print(setup, *row, engine_ms);
  return to_json(setup, *row, engine_ms);
}

int run_client(ClientOptions options) {
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return report("bench client", scene.error());
  ClientProcessSetup& setup = options.process;
  setup.scene = options.scene;
  setup.tandem = own_path();
  if (setup.tandemd.empty()) setup.tandemd = find_server();
  if (!options.in_memory && access(setup.tandemd.c_str(), X_OK) != 0) {
    return report("bench client",
                  Error{ErrorCode::kInvalidArgument, "no tandemd found; give its path with --server"});
  }
  if (!options.in_memory) setup.stop = &stop_on_signals();
  Json rows = Json::array();
  if (!options.json) {
    fmt::print("{}, ", scene->name);
    options.in_memory ? print_cost_heading() : print_process_heading();
  }
  for (const std::uint32_t bodies : options.bodies) {
    setup.choice.bodies = bodies;
    double engine_ms = 0;
    if (!options.in_memory) {
      const auto measured = measure_engine_step(*scene, setup);
      if (!measured) return report("bench client", measured.error());
      engine_ms = *measured;
    }
    for (const std::string& predictor : options.predictors) {
      for (const std::string& codec : options.codecs) {
        setup.choice.predictor = predictor;
        setup.choice.codec = codec;
        auto row = measure(options, *scene, setup, engine_ms);
        if (!row) return report("bench client", row.error());
        rows.push_back(std::move(*row));
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
      "client", "Measures what a client costs per frame, with DDS, next to the full simulation's step.");
  const auto options = std::make_shared<ClientOptions>();
  ClientProcessSetup& process = options->process;
  for (const std::string_view name : codec_names()) options->codecs.emplace_back(name);
  command.add_option("--scene", options->scene, "Scene by name or file").show_default();
  add_bodies_option(command, options->bodies);
  command.add_option("--predictor", options->predictors, "Predicted steps, separated by commas")
      .separated_by(',')
      .one_of(predictor_names())
      .show_default();
  command.add_option("--codec", options->codecs, "Codecs, separated by commas")
      .separated_by(',')
      .one_of(options->codecs)
      .show_default();
  add_threshold_options(command, process.choice);
  add_seed_option(command, process.seed, "Seed of the start block, the scripted inputs and the network");
  command.add_option("--runs", process.runs, "Number of runs of each row; their medians are printed")
      .range(1, 100)
      .show_default();
  command.add_option("--seconds", process.seconds, "Seconds to measure in each run")
      .range(1.0, 600.0)
      .show_default();
  command.add_option("--settle", process.settle_s, "Seconds from a client's start until it is measured")
      .range(1.0, 600.0)
      .show_default();
  command.add_option("--domain", process.domain, "DDS domain, on loopback").range(0, 230).show_default();
  command.add_option("--server", process.tandemd,
                     "Path of tandemd (default: next to this program, or in PATH)");
  command.add_flag("--in-memory", options->in_memory,
                   "Measure the client's own code and a sample of all bodies in this process, without DDS");
  command
      .add_option("--frames", options->frames, "Number of frames to measure for each row, with --in-memory")
      .range(1, 100000)
      .show_default();
  command.add_flag(
      "--json", options->json,
      "Print one JSON object: rows[scene, predictor, codec, bodies, runs, seconds, frames_per_s, engine_ms, "
      "cpu_ms{median, least, most}, kind_ms, thread_ms, syscalls, wakeups_per_s, idle_wakeups_per_s, "
      "resident_mb]; with --in-memory rows[scene, predictor, codec, bodies, frames, corrected_per_frame, "
      "engine_ms, frame_ms, predicted_ms, sampled_frame_ms, sample_ms, sample_beside_ms]");
  command.footer(
      "A server and `tandem join` run as processes on loopback. Processor times are in ms per frame of the "
      "whole\n"
      "client after it has joined, by kind (measured by the client itself; dds is the rest) and by thread. "
      "Also\n"
      "printed are system calls per frame (- where the kernel does not show them to this user) and wake-ups "
      "of\n"
      "all threads per second, while playing and while the server is suspended (idle). With --in-memory, "
      "all\n"
      "runs in one process and in simulated time. A frame then consists of receiving, the predicted step,\n"
      "decoding, applying and checking the hash; a sample, of positions, velocities, alive and types of all\n"
      "bodies; beside means a sample in a thread of its own while another one applies, by the wall clock.");
  command.on_chosen([options, &run] { run = [options] { return run_client(*options); }; });
}

}  // namespace tandem::lab
