// `bench_lab client`: the cost of a client with DDS, next to that of the full simulation, which a client need
// not run.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "sdk/core/tables/predictor_table.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/client_process.hpp"
#include "tests/bench/lab/commands.hpp"

namespace tandem::lab {
namespace {

struct ClientOptions {
  std::vector<std::uint32_t> bodies{10000};
  std::vector<std::string> predictors = predictor_names();
  std::vector<std::string> codecs = codec_choices();
  ClientProcessSetup process;
  bool json = false;
};

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

int run_client(ClientOptions options) {
  ClientProcessSetup& setup = options.process;
  const auto scene = scenes::load_scene(setup.scene);
  if (!scene) return refuse("client", scene.error());
  setup.stop = &stop_on_signals();
  Json rows = Json::array();
  if (!options.json) {
    fmt::print("{}, ", scene->name);
    print_process_heading();
  }
  for (const std::uint32_t bodies : options.bodies) {
    setup.choice.bodies = bodies;
    const auto engine_ms = measure_engine_step(*scene, setup);
    if (!engine_ms) return refuse("client", engine_ms.error());
    for (const std::string& predictor : options.predictors) {
      for (const std::string& codec : options.codecs) {
        setup.choice.predictor = predictor;
        setup.choice.codec = codec;
        const auto row = measure_client_process(setup);
        if (!row) return refuse("client", row.error());
        if (!options.json) print(setup, *row, *engine_ms);
        rows.push_back(to_json(setup, *row, *engine_ms));
        std::fflush(stdout);
      }
    }
  }
  if (options.json) fmt::print("{}\n", Json{{"rows", rows}}.dump());
  return 0;
}

}  // namespace

void add_client_process(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "client", "Measures what a client costs per frame, with DDS, next to the full simulation's step.");
  const auto options = std::make_shared<ClientOptions>();
  ClientProcessSetup& process = options->process;
  process.tandem = TANDEM_PROGRAM;
  process.tandemd = TANDEMD_PROGRAM;
  process.scene = "half_pipe";
  command.add_option("--scene", process.scene, "Scene by name or file").show_default();
  add_bodies_option(command, options->bodies);
  command.add_option("--predictor", options->predictors, "Predicted steps, separated by commas")
      .separated_by(',')
      .one_of(predictor_names())
      .show_default();
  command.add_option("--codec", options->codecs, "Codecs, separated by commas")
      .separated_by(',')
      .one_of(codec_choices())
      .show_default();
  add_threshold_options(command, process.choice);
  add_seed_option(command, process.seed, "Seed of the start block and the scripted inputs");
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
  command.add_option("--tool", process.tandem, "Path of tandem").existing_file().show_default();
  command.add_option("--server", process.tandemd, "Path of tandemd").existing_file().show_default();
  command.add_flag(
      "--json", options->json,
      "Print one JSON object: rows[scene, predictor, codec, bodies, runs, seconds, frames_per_s, engine_ms, "
      "cpu_ms{median, least, most}, kind_ms, thread_ms, syscalls, wakeups_per_s, idle_wakeups_per_s, "
      "resident_mb]");
  command.footer(
      "A server and `tandem join` run as processes on loopback. Processor times are in ms per frame of the whole\n"
      "client after it has joined, by kind (measured by the client itself; dds is the rest) and by thread. Also\n"
      "printed are system calls per frame (- where the kernel does not show them to this user) and wake-ups of\n"
      "all threads per second, while playing and while the server is suspended (idle).");
  command.on_chosen([options, &run] { run = [options] { return run_client(*options); }; });
}

}  // namespace tandem::lab
