// `bench_lab framerate`: updates per second of a user behind a slow link, as in the thesis's table 5.6.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "services/lab/commands/bench.hpp"
#include "tests/bench/lab/child.hpp"
#include "tests/bench/lab/commands.hpp"
#include "tests/bench/lab/framerate/enclave.hpp"
#include "tests/bench/lab/framerate/framerate.hpp"
#include "tests/bench/lab/framerate/paper_numbers.hpp"

namespace tandem::lab {
namespace {

constexpr const char* kCommand = "framerate";
// The rate of the thesis's phone with the full simulation of its first scene with 10,000 bodies.
constexpr double kPhoneUpdatesPerS = 4.4;

struct FramerateOptions {
  std::vector<std::string> scenes{"half_pipe"};
  std::vector<std::uint32_t> bodies{10000};
  std::vector<std::string> methods{
      std::string(kClientOnly), "none", "entropy", "limited", std::string(kBallistic), std::string(kField),
      std::string(kAsItComes)};
  std::vector<std::string> devices{"thin", "thesis"};
  double step_us = 0.8;
  std::uint32_t users = 0;
  FramerateSetup setup;
  double delay_ms = 5, queue_ms = 50;
  bool json = false;
};

bool streams(const FramerateOptions& options) {
  return std::any_of(options.methods.begin(), options.methods.end(),
                     [](const std::string& method) { return method != kClientOnly; });
}

/// Checks at the start what would otherwise fail after minutes.
Result<void> prepare(FramerateOptions& options) {
  options.setup.link.delay_ns = std::llround(options.delay_ms * 1e6);
  options.setup.link.queue_ns = std::llround(options.queue_ms * 1e6);
  if (!streams(options) || options.setup.kind == LinkKind::kMemory) return {};
  if (const auto tried = make_enclave("10.77.0.1"); !tried) {
    return fail(ErrorCode::kIo,
                fmt::format("cannot make a network of its own ({}): run it as root with /dev/net/tun, or "
                            "take --link memory",
                            tried.error().message));
  }
  return {};
}

void tell(const std::string& line) {
  if (isatty(STDERR_FILENO) == 1) fmt::print(stderr, "\r\033[K{}", line);
}

/// Empty for this machine without a limit.
Result<std::optional<Calibration>> set_up(FramerateOptions& options, const std::string& name,
                                          ThinDevice* processor) {
  options.setup.slowdown = 1;
  if (name == "native") return std::nullopt;
  auto found = name == "thesis" ? calibrate_by_step(*processor, kPhoneUpdatesPerS, options.step_us)
                                : calibrate(options.setup, *processor, kPhoneUpdatesPerS, tell);
  if (!found) return tl::unexpected(found.error());
  options.setup.slowdown = found->slowdown;
  return *found;
}

void measure_rows(const FramerateOptions& options, const std::vector<scenes::Scene>& scenes,
                  ThinDevice* processor, const std::optional<Calibration>& calibration,
                  std::vector<FramerateRow>& rows) {
  const bool only_papers = options.scenes == std::vector<std::string>{"all"};
  for (const scenes::Scene& scene : scenes) {
    for (const std::uint32_t bodies : options.bodies) {
      if (only_papers && !paper_updates_per_s(static_cast<int>(scene.number), bodies, "entropy")) continue;
      for (const std::string& method : options.methods) {
        FramerateRow& row = rows.emplace_back();
        row.scene = scene.name;
        const auto in_paper = paper_framerate_users(static_cast<int>(scene.number));
        row.users = options.users != 0 ? options.users : in_paper.value_or(scene.users);
        if (row.users == in_paper) row.number = static_cast<int>(scene.number);
        row.bodies = bodies;
        row.method = method;
        tell(fmt::format("{} with {} bodies, {}", row.scene, row.bodies, row.method));
        measure_row(options.setup, processor, calibration, row);
        if (stop_on_signals()) return;
      }
    }
  }
}

int run_framerate(FramerateOptions options) {
  const auto scenes = load_scenes(options.scenes);
  if (!scenes) return refuse(kCommand, scenes.error());
  if (const auto ready = prepare(options); !ready) return refuse(kCommand, ready.error());
  // The destructors of these objects remove all that is made here.
  options.setup.stop = &stop_on_signals();
  const bool slow = std::any_of(options.devices.begin(), options.devices.end(),
                                [](const std::string& name) { return name != "native"; });
  const std::unique_ptr<ThinDevice> processor = slow ? ThinDevice::create() : nullptr;
  std::vector<Calibration> calibrations;
  std::vector<FramerateRow> rows;
  for (const std::string& name : options.devices) {
    const auto device = set_up(options, name, processor.get());
    if (!device) return refuse(kCommand, device.error());
    if (*device) calibrations.push_back(**device);
    measure_rows(options, *scenes, *device ? processor.get() : nullptr, *device, rows);
    if (stop_on_signals()) return refuse(kCommand, Error{ErrorCode::kIo, "stopped"});
  }
  tell("");
  if (options.json) {
    fmt::print("{}\n", to_json(rows, processor ? processor->name() : std::string(), calibrations));
  } else {
    for (const Calibration& device : calibrations) {
      fmt::print(
          "{} device: {:.2f} % of a processor by {}; client-only there: {:.1f} updates/s (paper: {}){}\n",
          device.device, 100 * device.share, processor->name(), device.updates_per_s, kPhoneUpdatesPerS,
          device.step_us > 0 ? fmt::format(", with a step of {} us a body", device.step_us) : "");
    }
    fmt::print("{}", to_table(rows));
  }
  const bool all = std::all_of(rows.begin(), rows.end(), [](const FramerateRow& row) {
    return row.missing.empty() || row.method == kClientOnly;
  });
  return all ? 0 : 1;
}

}  // namespace

void add_framerate(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "framerate",
      "Measures the updates per second of a user behind a slow link, as in the thesis's table 5.6.");
  const auto options = std::make_shared<FramerateOptions>();
  command
      .add_option("--scene", options->scenes,
                  "Scenes by name or file, separated by commas; all for the rows of the thesis's table")
      .separated_by(',')
      .show_default();
  add_bodies_option(command, options->bodies);
  std::vector<std::string> methods = codec_choices();
  methods.emplace_back(kClientOnly);
  for (const std::string_view name : {kBallistic, kField, kAsItComes}) methods.emplace_back(name);
  std::erase(methods, "tracker");  // named by its predicted step, or by `auto`
  command
      .add_option(
          "--method", options->methods,
          "client-only, codecs, tracker's predicted steps, or auto (a server's default), separated by commas")
      .separated_by(',')
      .one_of(methods)
      .show_default();
  command
      .add_option(
          "--device", options->devices,
          "Devices of the measured user, separated by commas: native (this machine), or a slow processor, "
          "thin or thesis")
      .separated_by(',')
      .one_of({"native", "thin", "thesis"})
      .show_default();
  command
      .add_option("--step-us", options->step_us,
                  "Microseconds per body and step that the thesis device is to take")
      .range(0.01, 100.0)
      .show_default();
  command
      .add_option("--users", options->users,
                  "Number of users of each scene (default: as in the thesis's table 5.5, else the scene's)")
      .range(1, 16);
  command
      .add_option("--seconds", options->setup.seconds,
                  "Seconds to measure for each row, counted from the first update")
      .range(1.0, 600.0)
      .show_default();
  add_seed_option(command, options->setup.seed, "Seed of the start block and the scripted inputs");
  command
      .add_choice<LinkKind>(
          "--link", options->setup.kind,
          {{"namespaces", LinkKind::kNamespaces}, {"memory", LinkKind::kMemory}},
          "namespaces for DDS between processes, which needs root; memory for one process and simulated time")
      .show_default("namespaces");
  command.add_option("--rate", options->setup.link.bits_per_s, "Rate of the link each way, in bit/s")
      .range(1e4, 1e10)
      .show_default();
  command.add_option("--delay", options->delay_ms, "Delay of the link each way, in ms")
      .range(0.0, 10000.0)
      .show_default();
  command
      .add_option(
          "--queue", options->queue_ms,
          "Maximum time in ms that a packet waits for the link; the link drops packets that would wait "
          "longer")
      .range(0.0, 10000.0)
      .show_default();
  options->setup.tandem = TANDEM_PROGRAM;
  options->setup.tandemd = TANDEMD_PROGRAM;
  command.add_option("--tool", options->setup.tandem, "Path of tandem").existing_file().show_default();
  command.add_option("--server", options->setup.tandemd, "Path of tandemd").existing_file().show_default();
  command.add_flag("--json", options->json, "Print one JSON object: devices[...], rows[...]");
  command.footer(
      "Without --link memory this needs root: server and users run in network namespaces that one link "
      "joins.\n"
      "The slow devices get the share of a processor at which client-only reaches the thesis's 4.4 "
      "updates/s\n"
      "with 10,000 bodies: the thin device with our engine, the thesis device with a plain grid that "
      "computes\n"
      "one body after another.");
  command.on_chosen([options, &run] { run = [options] { return run_framerate(*options); }; });
}

}  // namespace tandem::lab
