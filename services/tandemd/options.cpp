#include "services/tandemd/options.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <charconv>
#include <cmath>
#include <cstdio>

#include "sdk/core/codec/codec.hpp"
#include "sdk/transport/port.hpp"
#include "services/sessions/session_plan.hpp"

namespace tandem::daemon {
namespace {

template <class T>
std::optional<T> number(const std::string& text) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return value;
}

tl::unexpected<Error> refuse(const char* flag, const std::string& what) {
  return fail(ErrorCode::kInvalidArgument, fmt::format("--{}: {}", flag, what));
}

bool takes_budget(const std::string& codec) { return codec == "limited" || codec == "tracker"; }
bool within(double value, double low, double high) { return value >= low && value <= high; }  // false for NaN

Result<void> check_words(const Settings& settings, Options& options) {
  if (settings.window && *settings.window != "auto") {
    options.window = number<std::uint32_t>(*settings.window);
    if (!options.window || *options.window < 1 || *options.window > 24)
      return refuse("window", "1 to 24 frames, or auto");
  }
  if (settings.rate && *settings.rate == "max") {
    options.free_rate = true;
  } else if (settings.rate) {
    options.rate_hz = number<double>(*settings.rate);
    if (!options.rate_hz || !within(*options.rate_hz, 1, 1000)) return refuse("rate", "1 to 1000 Hz, or max");
  }
  if (settings.stall_timeout && *settings.stall_timeout == "off") {
    options.stall_timeout_s.reset();
  } else if (settings.stall_timeout) {
    options.stall_timeout_s = number<double>(*settings.stall_timeout);
    if (!options.stall_timeout_s || !within(*options.stall_timeout_s, 0.01, 10)) {
      return refuse("stall-timeout", "0.01 to 10 seconds, or off");
    }
  }
  return {};
}

Result<void> check_numbers(const Settings& settings, const Options& options) {
  if (options.bodies == 0 || options.bodies > kMaxCapacity) {
    return refuse("bodies", fmt::format("1 to {}, not {}", kMaxCapacity, options.bodies));
  }
  if (options.lead > 1) return refuse("lead", "0 or 1");
  if (options.domain > 230) return refuse("domain", "0 to 230");
  if (options.client_limit < 1 || options.client_limit > 65536) return refuse("client-limit", "1 to 65536");
  if (options.threads < 1 || options.threads > 256) return refuse("threads", "1 to 256");
  if (options.threshold_m && !within(*options.threshold_m, 1e-9, 1e9))
    return refuse("threshold", "a positive length");
  if (!within(options.threshold_scale, 1e-6, 1e6)) return refuse("threshold-scale", "a positive factor");
  if (settings.threshold && settings.threshold_scale) {
    return refuse("threshold-scale", "not together with --threshold");
  }
  if (options.duration_s && !within(*options.duration_s, 0, 1e9))
    return refuse("duration", "seconds, not negative");
  if (options.automatic && options.codec == "none")
    return refuse("threshold", "auto chooses nothing with codec none, which has no threshold");
  if (options.automatic && settings.threshold) return refuse("threshold", "a length or auto, not both");
  if (!options.automatic && settings.target_bandwidth)
    return refuse("target-bandwidth", "needs --threshold auto");
  if (!options.automatic && settings.max_error) return refuse("max-error", "needs --threshold auto");
  if (settings.target_bandwidth && !within(options.target_mbit_per_s, 0.001, 1e6))
    return refuse("target-bandwidth", "Mbit/s, at least 0.001");
  if (options.max_error_m && !within(*options.max_error_m, 1e-9, 1e9))
    return refuse("max-error", "a positive length");
  if (options.budget_bytes && !takes_budget(options.codec))
    return refuse("budget", "only with --codec limited or tracker");
  if (options.budget_bytes && *options.budget_bytes < sessions::kLeastBudgetBytes)
    return refuse("budget", fmt::format("at least {} bytes", sessions::kLeastBudgetBytes));
  return {};
}

template <class T>
void take(T& to, const std::optional<T>& from) {
  if (from) to = *from;
}

template <class T>
std::optional<T> first_of(const std::optional<T>& over, const std::optional<T>& under) {
  return over ? over : under;
}

}  // namespace

Settings overlay(const Settings& over, const Settings& under) {
  Settings all;
  const auto pick = [&](auto member) { all.*member = first_of(over.*member, under.*member); };
  for (auto member : {&Settings::scene, &Settings::session, &Settings::codec, &Settings::predictor,
                      &Settings::window, &Settings::rate, &Settings::stall_timeout, &Settings::hash_log}) {
    pick(member);
  }
  for (auto member : {&Settings::bodies, &Settings::domain, &Settings::budget_bytes, &Settings::lead,
                      &Settings::client_limit, &Settings::wait_for, &Settings::threads, &Settings::users}) {
    pick(member);
  }
  for (auto member : {&Settings::threshold, &Settings::threshold_scale, &Settings::duration,
                      &Settings::target_bandwidth, &Settings::max_error}) {
    pick(member);
  }
  pick(&Settings::seed);
  pick(&Settings::scripted);
  pick(&Settings::automatic);
  // What a flag excludes goes with it, when only the file says it.
  if (over.threshold || over.automatic) all.threshold = over.threshold;
  if (over.threshold) all.threshold_scale = over.threshold_scale;
  if (over.threshold_scale) all.threshold = over.threshold;
  if (over.threshold || over.codec == "none") all.automatic = over.automatic;
  if (over.automatic == false || !all.automatic.value_or(false)) {
    all.target_bandwidth = over.target_bandwidth;
    all.max_error = over.max_error;
  }
  if (over.codec && !takes_budget(*over.codec)) all.budget_bytes = over.budget_bytes;
  return all;
}

Result<Options> check_settings(const Settings& settings) {
  Options options;
  if (!settings.scene || settings.scene->empty()) return refuse("scene", "a scene's name or file is needed");
  if (!settings.bodies) return refuse("bodies", "how many are needed");
  take(options.scene, settings.scene);
  take(options.session, settings.session);
  take(options.codec, settings.codec);
  take(options.predictor, settings.predictor);
  take(options.hash_log, settings.hash_log);
  take(options.bodies, settings.bodies);
  take(options.domain, settings.domain);
  options.budget_bytes = settings.budget_bytes;
  take(options.lead, settings.lead);
  take(options.client_limit, settings.client_limit);
  take(options.wait_for, settings.wait_for);
  take(options.threads, settings.threads);
  take(options.users, settings.users);
  take(options.seed, settings.seed);
  take(options.scripted, settings.scripted);
  take(options.threshold_scale, settings.threshold_scale);
  take(options.automatic, settings.automatic);
  take(options.target_mbit_per_s, settings.target_bandwidth);
  options.max_error_m = settings.max_error;
  options.threshold_m = settings.threshold;
  options.duration_s = settings.duration;
  if (options.duration_s && *options.duration_s == 0) options.duration_s.reset();
  if (const auto named = transport::check_session_name(options.session); !named) {
    return refuse("session", named.error().message);
  }
  if (const auto good = check_words(settings, options); !good) return tl::unexpected(good.error());
  if (const auto good = check_numbers(settings, options); !good) return tl::unexpected(good.error());
  return options;
}

CommandLine parse_command_line(int argc, const char* const* argv) {
  CLI::App app{"Simulates a scene and streams it over DDS to clients, which hold bit-identical state.",
               "tandemd"};
  app.set_version_flag("--version", "tandemd " TANDEM_VERSION);
  app.footer(
      "Exit codes: 0 done, 1 failed (also: the session has a server already), 2 wrong usage. SIGINT and "
      "SIGTERM end it cleanly.");
  Settings flags;
  std::string config;
  bool json = false, scripted = false;
  app.add_option("--scene", flags.scene, "Scene by name or file");
  app.add_option("--bodies", flags.bodies, "Number of bodies");
  app.add_option("--session", flags.session, "Name that clients join by [default]");
  app.add_option("--domain", flags.domain, "DDS domain [0]");
  app.add_option("--codec", flags.codec, fmt::format("{} [tracker]", fmt::join(codec_names(), ", ")));
  app.add_option("--predictor", flags.predictor,
                 "Predicted step of server and clients: ballistic, field, contact, or auto: field with "
                 "codec tracker and at most 50,000 bodies, else ballistic [auto]");
  app.add_option_function<std::string>(
         "--threshold",
         [&flags](const std::string& text) {
           flags.automatic = text == "auto";
           if (*flags.automatic) return;
           flags.threshold = number<double>(text);
           if (!flags.threshold) throw CLI::ValidationError("--threshold", "a positive length, or auto");
         },
         "Position error above which a body is corrected, in metres, or auto: chosen at run time [the "
         "scene's]")
      ->type_name("METRES|auto");
  app.add_option(
      "--target-bandwidth", flags.target_bandwidth,
      "Mbit/s of payload at the nominal rate that --threshold auto keeps to, from a quarter of the threshold "
      "it starts from up to --max-error");
  app.add_option(
      "--max-error", flags.max_error,
      "Largest threshold of --threshold auto, in metres; below the scene's it is also the first [four "
      "times the scene's]");
  app.add_option("--threshold-scale", flags.threshold_scale, "The scene's threshold times this [1]");
  app.add_option("--budget", flags.budget_bytes,
                 "Bytes of corrections per frame with --codec limited [6553] or tracker [no limit]");
  app.add_option("--window", flags.window,
                 "Frames the server may run ahead of its slowest participant, or auto [auto]");
  app.add_option("--lead", flags.lead, "Frames a client may simulate beyond its last delta: 0 or 1 [1]");
  app.add_option("--rate", flags.rate, "Frames per second, or max [the scene's]");
  app.add_option("--stall-timeout", flags.stall_timeout,
                 "Seconds a participant may hold up the others within 10 s, or off [0.5]");
  app.add_option("--client-limit", flags.client_limit, "Clients at once [256]");
  app.add_option("--wait-for", flags.wait_for, "Participants that must play before frame 1 [0]");
  app.add_option("--duration", flags.duration,
                 "Seconds from the first frame; as long again is waited for it [no end]");
  app.add_option("--threads", flags.threads, "Threads of the full simulation [1]");
  app.add_option("--seed", flags.seed, "Seed of start block and script [1]");
  app.add_flag("--scripted", scripted, "The server itself sends what the scene's users would");
  app.add_option("--users", flags.users, "Users of that script [as many as the scene says]");
  app.add_option("--hash-log", flags.hash_log, "File to write `epoch,frame,hash` of every frame to");
  app.add_option("--config", config,
                 "Configuration file (protobuf text, idl/server.proto); flags win over it");
  app.add_flag("--json", json, "Print one JSON object on stdout at the end");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return {.options = std::nullopt, .exit_code = app.exit(error) == 0 ? 0 : 2};
  }
  if (scripted) flags.scripted = true;
  Settings settings = flags;
  if (!config.empty()) {
    const auto file = load_config(config);
    if (!file) {
      fmt::print(stderr, "tandemd: {}\n", file.error().message);
      return {.options = std::nullopt, .exit_code = 2};
    }
    settings = overlay(flags, *file);
  }
  auto options = check_settings(settings);
  if (!options) {
    fmt::print(stderr, "tandemd: {}\nRun with --help for all flags.\n", options.error().message);
    return {.options = std::nullopt, .exit_code = 2};
  }
  options->json = json;
  return {.options = std::move(*options), .exit_code = 0};
}

}  // namespace tandem::daemon
