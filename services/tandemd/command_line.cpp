#include "services/tandemd/command_line.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "services/commandline/commandline.hpp"
#include "services/planning/number.hpp"
#include "services/tandemd/config.hpp"

namespace tandem::daemon {
namespace {

/// Flags that each set a field of the configuration.
class Flags {
 public:
  Flags(commandline::Command app, idl::ServerConfig& config) : app_(app), config_(&config) {}

  template <class T>
  void add(const char* flag, void (idl::ServerConfig::*set)(T), const std::string& help) {
    commandline::Option option = app_.add_option_function<T>(
        flag, [config = config_, set](T value) { (config->*set)(value); }, help);
    // The parser would read -1 and numbers that are too large as the maximum.
    if constexpr (std::is_unsigned_v<T>)
      option.check(
          [](const std::string& text) { return planning::number<T>(text) ? "" : "must be a whole number"; });
  }
  void add(const char* flag, std::string* (idl::ServerConfig::*field)(), const std::string& help) {
    app_.add_option_function<std::string>(
        flag, [config = config_, field](const std::string& value) { *(config->*field)() = value; }, help);
  }

 private:
  commandline::Command app_;
  idl::ServerConfig* config_;
};

// fmt::print would throw where stderr takes no more.
void print_error(const std::string& text) { std::fputs(text.c_str(), stderr); }

void set_threshold(idl::ServerConfig& config, const std::string& text) {
  config.set_threshold_auto(text == "auto");
  if (config.threshold_auto()) return;
  const auto length = planning::number<double>(text);
  if (!length) commandline::refuse("--threshold", "must be a length in metres, or auto");
  config.set_threshold(*length);
}

void add_streams(idl::ServerConfig& config, const std::vector<std::string>& texts) {
  config.clear_stream();
  for (const std::string& text : texts) {
    auto stream = parse_stream(text);
    if (!stream) commandline::refuse("--stream", stream.error().message);
    *config.add_stream() = std::move(*stream);
  }
}

std::string stream_keys() {
  std::vector<std::string_view> keys;
  for (const planning::StreamOption& option : planning::kStreamOptions) keys.push_back(option.key);
  return fmt::format("{}", fmt::join(keys, ", "));
}

void add_flags(commandline::Command app, idl::ServerConfig& config) {
  using Config = idl::ServerConfig;
  const Options defaults;
  Flags flags(app, config);
  flags.add("--scene", &Config::mutable_scene, "Scene by name or file");
  flags.add("--bodies", &Config::set_bodies, "Number of bodies");
  flags.add("--session", &Config::mutable_session,
            fmt::format("Name that clients join by [{}]", defaults.session));
  flags.add("--domain", &Config::set_domain, fmt::format("DDS domain [{}]", defaults.domain));
  flags.add("--codec", &Config::mutable_codec,
            fmt::format("{} [{}]", fmt::join(codec_names(), ", "), defaults.choice.codec));
  const PredictorTraits& best = predictors().front();
  const std::string_view basic = basic_predictor().name;
  flags.add(
      "--predictor", &Config::mutable_predictor,
      fmt::format(
          "Predicted step of server and clients: {}, or auto. With codec tracker and up to {} spheres of "
          "about the same size, auto publishes one stream with {} and one with {}, else one with {} [{}]",
          fmt::join(predictor_names(), ", "), best.most_bodies, basic, best.name, basic,
          defaults.choice.predictor));
  app.add_option_function<std::vector<std::string>>(
         "--stream", [&config](const std::vector<std::string>& texts) { add_streams(config, texts); },
         "Adds a stream, NAME:PREDICTOR or NAME:key=value,...; repeatable, up to 8 streams of the same "
         "world. The keys are " +
             stream_keys() +
             "; the flags of these names set what is left out. Clients choose their stream, and one that "
             "does not choose plays the first. The server computes a stream only while somebody plays it "
             "[with --predictor auto, where field pays: thin:ballistic and rich:field]")
      .type_name("NAME:SPEC")
      .one_value_each();
  app.add_option_function<std::string>(
         "--threshold", [&config](const std::string& text) { set_threshold(config, text); },
         "Position error above which a body is corrected, in metres, or auto to choose it at run time [the "
         "scene's]")
      .type_name("METRES|auto");
  flags.add(
      "--target-bandwidth", &Config::set_target_bandwidth,
      "Target of --threshold auto, in Mbit/s of payload at the nominal rate. The threshold stays between a "
      "quarter of its first value and --max-error");
  flags.add(
      "--max-error", &Config::set_max_error,
      "Maximum threshold of --threshold auto, in metres. If it is below the scene's threshold, it is also "
      "the first one [four times the scene's]");
  flags.add("--threshold-scale", &Config::set_threshold_scale,
            fmt::format("Factor for the scene's threshold [{}]", defaults.choice.threshold_scale));
  flags.add(
      "--budget", &Config::set_budget_bytes,
      fmt::format("Maximum bytes of corrections per frame, with --codec limited [{}] or tracker [no limit]",
                  kPaperBudgetBytes));
  flags.add("--window", &Config::mutable_window,
            "Maximum frames that the server may run ahead of its slowest participant, or auto [auto]");
  flags.add(
      "--lead", &Config::set_lead,
      fmt::format("Frames that a client may simulate beyond its last delta: 0 or 1 [{}]", defaults.lead));
  flags.add("--rate", &Config::mutable_rate, "Frames per second, or max [the scene's]");
  flags.add("--stall-timeout", &Config::mutable_stall_timeout,
            fmt::format("Maximum seconds that a participant may delay the others within 10 s, or off [{}]",
                        *defaults.stall_timeout_s));
  flags.add("--client-limit", &Config::set_client_limit,
            fmt::format("Maximum number of clients [{}]", defaults.client_limit));
  flags.add("--wait-for", &Config::set_wait_for,
            fmt::format("Participants that must play before frame 1 [{}]", defaults.wait_for));
  flags.add("--duration", &Config::set_duration,
            "Seconds to run, counted from the first frame; the server waits for that frame as long [no end]");
  flags.add("--threads", &Config::set_threads,
            fmt::format("Threads of the full simulation [{}]", defaults.choice.threads));
  flags.add("--seed", &Config::set_seed,
            fmt::format("Seed of the start block and the script [{}]", defaults.seed));
  app.add_flag_function(
      "--scripted", [&config] { config.set_scripted(true); },
      "Run the scene's script in the server, which then sends the inputs of simulated users");
  flags.add("--users", &Config::set_users, "Number of users in that script [the scene's]");
  flags.add("--checkpoint-dir", &Config::mutable_checkpoint_dir,
            "Folder for checkpoints of this session. The server goes on from the newest when it starts again "
            "[no checkpoints]");
  flags.add("--checkpoint-interval", &Config::set_checkpoint_interval,
            fmt::format("Seconds between two checkpoints [{}]", defaults.checkpoint.interval_s));
  flags.add(
      "--checkpoint", &Config::mutable_checkpoint,
      "auto: start afresh where there is no good checkpoint; require: do not start then; off: neither read "
      "nor write any [auto]");
  app.add_flag_function(
      "--standby", [&config] { config.set_standby(true); },
      "Stand by for the session's live server: receive its checkpoints, and take over when it is gone or hands "
      "over (tandem handover). Give the same scene, bodies and seed as there");
  flags.add(
      "--standby-rank", &Config::set_standby_rank,
      fmt::format("Of several servers that stand by, the one of the lowest rank takes over: 1 to {} [{}]",
                  kMostRank, defaults.standby_rank));
  flags.add("--metrics", &Config::mutable_metrics,
            "ADDRESS:PORT, or a PORT of 127.0.0.1, to serve metrics for Prometheus at /metrics, and /healthz "
            "and /readyz [none]");
  flags.add("--hash-log", &Config::mutable_hash_log, "File for a line `epoch,frame,hash` of every frame");
}

}  // namespace

CommandLine parse_command_line(int argc, const char* const* argv) {
  commandline::Program app{
      "Simulates a scene and streams it over DDS to clients, which hold bit-identical state.", "tandemd"};
  app.version("tandemd " TANDEM_VERSION);
  app.footer(
      "Exit codes: 0 done, 1 failed (for example, the session already has a server), 2 wrong usage. SIGINT "
      "and SIGTERM stop the server cleanly.");
  idl::ServerConfig config;
  std::string path;
  bool json = false;
  add_flags(app, config);
  app.add_option("--config", path, "Configuration file (protobuf text, idl/server.proto); flags override it");
  app.add_flag("--json", json, "Print one JSON object on stdout at the end");
  if (const auto code = app.parse(argc, argv)) return {.options = std::nullopt, .exit_code = *code};
  if (!path.empty()) {
    auto file = load_config(path);
    if (!file) {
      print_error(fmt::format("tandemd: {}\n", file.error().message));
      return {.options = std::nullopt, .exit_code = 2};
    }
    config = merge(config, std::move(*file));
  }
  auto options = check_config(config);
  if (!options) {
    print_error(fmt::format("tandemd: {}\nRun with --help for all flags.\n", options.error().message));
    return {.options = std::nullopt, .exit_code = 2};
  }
  options->json = json;
  return {.options = std::move(*options), .exit_code = 0};
}

}  // namespace tandem::daemon
