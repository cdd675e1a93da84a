#include "services/tandemd/configuration/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "services/host/planning/number.hpp"
#include "services/program/commandline/commandline.hpp"
#include "services/program/metrics/probe.hpp"
#include "services/tandemd/configuration/config.hpp"
#include "services/tandemd/configuration/config_file.hpp"
#include "services/tandemd/configuration/mistakes.hpp"
#include "services/tandemd/configuration/reload.hpp"
#include "services/tandemd/configuration/settings.hpp"

namespace tandem::daemon {
namespace {

/// "{text,json}" of "text or json", which completions offer; empty for what is no list of words, such as "a
/// path".
std::string list_of(std::string_view takes) {
  std::string list;
  bool several = false;
  while (!takes.empty()) {
    const std::size_t end = std::min(takes.find_first_of(", "), takes.size());
    const std::string_view word = takes.substr(0, end);
    if (word.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") != std::string_view::npos || word == "a")
      return {};
    several = several || end < takes.size();
    if (!word.empty() && word != "or") list += (list.empty() ? "" : ",") + std::string(word);
    takes.remove_prefix(std::min(end + 1, takes.size()));
  }
  return several ? "{" + list + "}" : std::string();
}

/// Flags that each set a field of the configuration.
class Flags {
 public:
  Flags(commandline::Command app, idl::ServerConfig& config) : app_(app), config_(&config) {}

  template <class T>
  void add(const char* field, void (idl::ServerConfig::*set)(T)) {
    commandline::Option option = app_.add_option_function<T>(
        flag_of(field), [config = config_, set](T value) { (config->*set)(value); },
        text_of(*find_setting(field)));
    // The parser would read -1 and numbers that are too large as the maximum.
    if constexpr (std::is_unsigned_v<T>)
      option.check(
          [](const std::string& text) { return planning::number<T>(text) ? "" : "must be a whole number"; });
  }
  void add(const char* field, std::string* (idl::ServerConfig::*text)()) {
    commandline::Option option = app_.add_option_function<std::string>(
        flag_of(field), [config = config_, text](const std::string& value) { *(config->*text)() = value; },
        text_of(*find_setting(field)));
    if (const std::string list = list_of(find_setting(field)->takes); !list.empty()) option.type_name(list);
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

std::string help_of(std::string_view field) { return text_of(*find_setting(field)); }

void add_flags(commandline::Command app, idl::ServerConfig& config) {
  using Config = idl::ServerConfig;
  Flags flags(app, config);
  flags.add("scene", &Config::mutable_scene);
  flags.add("bodies", &Config::set_bodies);
  flags.add("engine", &Config::mutable_engine);
  flags.add("engine_socket", &Config::mutable_engine_socket);
  flags.add("engine_fd", &Config::set_engine_fd);
  flags.add("engine_listen", &Config::mutable_engine_listen);
  flags.add("engine_token", &Config::mutable_engine_token);
  flags.add("topology", &Config::mutable_topology);
  flags.add("session", &Config::mutable_session);
  flags.add("domain", &Config::set_domain);
  flags.add("secure", &Config::mutable_secure);
  flags.add("profile", &Config::mutable_profile);
  flags.add("codec", &Config::mutable_codec);
  flags.add("predictor", &Config::mutable_predictor);
  app.add_option_function<std::vector<std::string>>(
         "--stream", [&config](const std::vector<std::string>& texts) { add_streams(config, texts); },
         "NAME:PREDICTOR or NAME:key=value,...: " + help_of("stream"))
      .type_name("NAME:SPEC")
      .one_value_each();
  app.add_option_function<std::string>(
         "--threshold", [&config](const std::string& text) { set_threshold(config, text); },
         help_of("threshold") + ", or auto to choose it at run time")
      .type_name("METRES|auto");
  flags.add("target_bandwidth", &Config::set_target_bandwidth);
  flags.add("max_error", &Config::set_max_error);
  flags.add("threshold_scale", &Config::set_threshold_scale);
  flags.add("budget_bytes", &Config::set_budget_bytes);
  flags.add("window", &Config::mutable_window);
  flags.add("lead", &Config::set_lead);
  flags.add("rate", &Config::mutable_rate);
  flags.add("stall_timeout", &Config::mutable_stall_timeout);
  flags.add("client_limit", &Config::set_client_limit);
  flags.add("wait_for", &Config::set_wait_for);
  flags.add("duration", &Config::set_duration);
  flags.add("threads", &Config::set_threads);
  flags.add("pipeline", &Config::mutable_pipeline);
  flags.add("seed", &Config::set_seed);
  app.add_flag_function(
      "--scripted", [&config] { config.set_scripted(true); }, find_setting("scripted")->help);
  flags.add("users", &Config::set_users);
  flags.add("checkpoint_dir", &Config::mutable_checkpoint_dir);
  flags.add("checkpoint_interval", &Config::set_checkpoint_interval);
  flags.add("checkpoint", &Config::mutable_checkpoint);
  app.add_flag_function(
      "--standby", [&config] { config.set_standby(true); }, find_setting("standby")->help);
  flags.add("standby_rank", &Config::set_standby_rank);
  flags.add("metrics", &Config::mutable_metrics);
  flags.add("hash_log", &Config::mutable_hash_log);
  flags.add("log_format", &Config::mutable_log_format);
  flags.add("log_level", &Config::mutable_log_level);
}

CommandLine ended(int exit_code, std::string why = {}) {
  return {.options = std::nullopt, .exit_code = exit_code, .why = std::move(why)};
}

CommandLine refused(const std::vector<Error>& errors) {
  const auto names_a_flag = [](const Error& error) { return error.message.starts_with("--"); };
  for (const Error& error : errors) print_error(fmt::format("tandemd: {}\n", error.message));
  if (std::ranges::any_of(errors, names_a_flag)) print_error("Run with --help for all flags.\n");
  return ended(2, errors.front().message);
}
CommandLine refused(const Error& error) { return refused(std::vector{error}); }

/// --check-config
CommandLine checked(const std::string& path, const idl::ServerConfig& flags) {
  if (const auto mistakes = find_mistakes(path, flags); !mistakes.empty()) return refused(mistakes);
  return ended(std::fputs("the configuration is good\n", stdout) < 0 || std::fflush(stdout) != 0 ? 1 : 0);
}

}  // namespace

CommandLine parse_command_line(int argc, const char* const* argv) {
  commandline::Program app{
      "Simulates a scene and streams it over DDS to clients, which hold bit-identical state.", "tandemd"};
  app.version("tandemd " TANDEM_VERSION);
  app.footer(
      "Exit codes: 0 done, 1 failed (for example, the session already has a server), 2 wrong usage. SIGINT "
      "and SIGTERM stop the server cleanly. At SIGHUP it reads --config again, changes client_limit, "
      "stall_timeout and checkpoint_interval, and names what needs a restart; without --config, SIGHUP stops it.");
  idl::ServerConfig config;
  std::string path, question, why;
  bool json = false, check = false, print = false;
  add_flags(static_cast<const commandline::Command&>(app), config);
  app.add_option("--config", path,
                 "Configuration file (protobuf text); flags override it. --print-config shows its form");
  app.add_flag("--check-config", check,
               "Check configuration and scene as a start does, say all that is wrong, and exit");
  app.add_flag("--print-config", print,
               "Print the configuration in force as a file, with what each field means and takes, and exit");
  app.add_option("--probe", question, metrics::kProbeHelp);
  app.add_flag("--json", json, "Print one JSON object on stdout at the end");
  if (const auto code = app.parse(argc, argv, &why)) return ended(*code, why);
  if (!question.empty()) return ended(metrics::probe("tandemd", question));
  Places places;
  const idl::ServerConfig flags = config;
  if (check) return checked(path, flags);
  if (!path.empty()) {
    auto file = load_config(path);
    if (!file) return refused(file.error());
    places = places_beside(config, std::move(file->places));
    config = merge(config, std::move(file->config));
  }
  if (print) {
    const std::string text = print_config(config);
    return ended(std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0 ? 1 : 0);
  }
  auto options = check_config(config, places);
  if (!options) return refused(options.error());
  options->json = json;
  CommandLine command{.options = std::move(*options), .exit_code = 0};
  if (!path.empty())
    command.reread = [rereader = Rereader(path, flags, config)]() mutable { return rereader.read(); };
  return command;
}

int inherited_engine(int argc, const char* const* argv) {
  constexpr std::string_view kFlag = "--engine-fd";
  for (int i = 1; i < argc; ++i) {
    std::string_view word(argv[i]);
    if (!word.starts_with(kFlag)) continue;
    word.remove_prefix(kFlag.size());
    if (word.empty() && i + 1 < argc) word = argv[i + 1];
    if (word.starts_with('=')) word.remove_prefix(1);
    if (const auto descriptor = planning::number<std::uint16_t>(word)) return *descriptor;
  }
  return -1;
}

}  // namespace tandem::daemon
