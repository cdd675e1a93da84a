#include "services/tandemd/configuration/command_line.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/program/commandline/commandline.hpp"
#include "services/program/configuration/command_line.hpp"
#include "services/program/number.hpp"
#include "services/tandemd/configuration/config.hpp"
#include "services/tandemd/configuration/form.hpp"
#include "services/tandemd/configuration/mistakes.hpp"
#include "services/tandemd/configuration/reload.hpp"

namespace tandem::daemon {
namespace {

void set_threshold(idl::ServerConfig& config, const std::string& text) {
  config.set_threshold_auto(text == "auto");
  if (config.threshold_auto()) return;
  const auto length = text::number<double>(text);
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

/// The flags of fields that take something else than their values.
auto own_flags(idl::ServerConfig& config) {
  using configuration::Setting;
  decltype(configuration::Rules::flags) flags;
  flags["stream"] = [&config](commandline::Command app, const Setting& setting) {
    app.add_option_function<std::vector<std::string>>(
           setting.flag, [&config](const std::vector<std::string>& texts) { add_streams(config, texts); },
           "NAME:PREDICTOR or NAME:key=value,...: " + setting.text())
        .type_name("NAME:SPEC")
        .one_value_each();
  };
  flags["threshold"] = [&config](commandline::Command app, const Setting& setting) {
    app.add_option_function<std::string>(
           setting.flag, [&config](const std::string& text) { set_threshold(config, text); },
           setting.text() + ", or auto to choose it at run time")
        .type_name("METRES|auto");
  };
  flags["threshold_auto"] = [](commandline::Command /*app*/, const Setting& /*setting*/) {};
  return flags;
}

CommandLine ended(const configuration::Outcome& outcome) {
  return {.options = std::nullopt, .exit_code = outcome.exit_code.value_or(0), .why = outcome.why};
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
  idl::ServerConfig config, flags;
  bool json = false;
  configuration::Rules rules{.displace = {}, .flags = own_flags(config), .mistakes = {}, .check = {}};
  using Message = google::protobuf::Message;
  rules.displace = [&flags](const Message& given, Message& file) {
    flags.CopyFrom(given);
    displace(flags, dynamic_cast<idl::ServerConfig&>(file));
  };
  rules.mistakes = [](const std::string& path, const Message& given) {
    return find_mistakes(path, dynamic_cast<const idl::ServerConfig&>(given));
  };
  app.add_flag("--json", json, "Print one JSON object on stdout at the end");
  const auto read = configuration::read_command_line(app, "tandemd", form(), config, rules, argc, argv);
  if (read.exit_code) return ended(read);
  auto options = check_config(config, read.places);
  if (!options) return ended(configuration::refuse("tandemd", {options.error()}));
  options->json = json;
  CommandLine command{.options = std::move(*options), .exit_code = 0};
  if (!read.path.empty())
    command.reread = [rereader = Rereader(read.path, flags, config)]() mutable { return rereader.read(); };
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
    if (const auto descriptor = text::number<std::uint16_t>(word)) return *descriptor;
  }
  return -1;
}

}  // namespace tandem::daemon
