#include "services/tandemd/configuration/settings.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/port.hpp"
#include "sdk/workers/workers.hpp"
#include "services/host/host.hpp"
#include "services/host/planning/wishes.hpp"
#include "services/tandemd/configuration/options.hpp"
#include "tandem/simulation.hpp"

namespace tandem::daemon {
namespace {

std::string stream_keys() {
  std::vector<std::string_view> keys;
  keys.reserve(std::size(planning::kStreamOptions));
  for (const planning::StreamOption& option : planning::kStreamOptions) keys.push_back(option.key);
  return fmt::format("{}", fmt::join(keys, ", "));
}

std::string in_quotes(std::string_view text) { return fmt::format("\"{}\"", text); }

std::vector<Setting> session_settings(const Options& defaults) {
  return {
      {"scene", "Scene by name or file", "the name of a scene, or the path of a .textproto file", "",
       in_quotes("half_pipe")},
      {"bodies", "Number of bodies", fmt::format("1 to {}, as far as the scene has room", engine::kMaxBodies),
       "", "10000"},
      {"session", "Name that clients join by", "1 to 64 of A-Z, a-z, 0-9, '.', '_' and '-'", defaults.session,
       in_quotes(defaults.session)},
      {"engine",
       "Command of an engine in another process, instead of a scene (idl/ENGINE.md). The server starts it with sh, and again "
       "when it ends by itself, from the last checkpoint if there is one. imd://HOST:PORT: a simulation that speaks IMD, by "
       "tandem-imd",
       "a command, or imd://HOST:PORT", "", in_quotes("python3 boids.py")},
      {"engine_socket", "Instead of a command: where the server waits for an engine of the same user",
       "a path", "", in_quotes("/run/user/1000/tandem-engine")},
      {"engine_fd",
       "Instead of a command: a descriptor that the server inherits and that is connected to the engine",
       "0 to 65535", "", "3"},
      {"engine_listen",
       "Where the server waits for an engine that runs on another machine; with a command, for the one that the command "
       "starts there",
       "ADDRESS:PORT, with an address in numbers", "", in_quotes("10.0.0.1:7400")},
      {"engine_token",
       "File with the token that such an engine has to show in TANDEM_DOOR_TOKEN; a command may do without",
       "a path that nobody else can read", "", in_quotes("/etc/tandem/engine-token")},
      {"topology", "With an engine at imd://: what its atoms are",
       "a .gro file, a data file of LAMMPS, or lines COUNT NAME RADIUS RRGGBBAA MASS", "",
       in_quotes("conf.gro")},
      {"domain", "DDS domain", fmt::format("0 to {}", transport::kMaxDomain),
       fmt::format("{}", defaults.domain), fmt::format("{}", defaults.domain)},
      {"secure", "Identity of the server for DDS Security; those without one are then strangers",
       "a folder that `tandem pki issue server` made", "none", in_quotes("/etc/tandem/identity")},
      {"profile", "The kind of network, with which CYCLONEDDS_URI is not used",
       "loopback, lan, wifi, wan or multihomed, with parameters behind a colon, as in lan:interface=eth0",
       "CYCLONEDDS_URI decides", in_quotes("lan")},
  };
}

std::vector<Setting> stream_settings(const Options& defaults) {
  const PredictorTraits& best = predictors().front();
  const std::string_view basic = basic_predictor().name;
  const sessions::SessionChoice& choice = defaults.choice;
  return {
      {"codec", "How corrections are written", fmt::format("{}", fmt::join(codec_names(), ", ")),
       choice.codec, in_quotes(choice.codec)},
      {"predictor",
       fmt::format(
           "Predicted step of server and clients. With codec tracker and up to {} spheres of about the "
           "same size, auto publishes one stream with {} and one with {}, else one with {}",
           best.most_bodies, basic, best.name, basic),
       fmt::format("{}, or auto", fmt::join(predictor_names(), ", ")), choice.predictor,
       in_quotes(choice.predictor)},
      {"stream",
       "Adds a stream of the same world; repeatable. What it leaves out is set by the options of these names. "
       "Clients choose their stream, and one that does not choose plays the first. The server computes a stream "
       "only while somebody plays it",
       fmt::format("a name and {}; up to 8 streams", stream_keys()),
       "with predictor auto: thin:ballistic and, where field pays, rich:field",
       R"({ name: "thin" predictor: "ballistic" })"},
      {"threshold", "Position error above which a body is corrected", std::string(planning::kLength),
       "the scene's", "0.05"},
      {"threshold_auto", "The server chooses the threshold at run time", "true or false", "false", "false"},
      {"target_bandwidth",
       "Target of an automatic threshold, in Mbit/s of payload at the nominal rate. The threshold stays between "
       "a quarter of its first value and max-error",
       "0.001 to 1e6", "", "0.5"},
      {"max_error",
       "Maximum of an automatic threshold. If it is below the scene's threshold, it is also the first one",
       std::string(planning::kLength), "four times the scene's", "0.2"},
      {"threshold_scale", "Factor for the scene's threshold", "1e-6 to 1e6",
       fmt::format("{}", choice.threshold_scale), fmt::format("{}", choice.threshold_scale)},
      {"budget_bytes", "Maximum bytes of corrections per frame, with codec limited or tracker",
       fmt::format("at least {}", planning::kLeastBudgetBytes),
       fmt::format("limited: {}; tracker: no limit", kPaperBudgetBytes),
       fmt::format("{}", kPaperBudgetBytes)},
  };
}

std::vector<Setting> service_settings(const Options& defaults) {
  const auto number = [](auto value) { return fmt::format("{}", value); };
  return {
      {"window", "Maximum frames that the server may run ahead of its slowest participant",
       fmt::format("1 to {}, or auto", host::ServiceConfig().window_ceiling), "auto", in_quotes("auto")},
      {"lead", "Frames that a client may simulate beyond its last delta", "0 or 1", number(defaults.lead),
       number(defaults.lead)},
      {"rate", "Frames per second", "1 to 1000, or max", "the scene's", in_quotes("30")},
      {"stall_timeout", "Maximum seconds that a participant may delay the others within 10 s",
       "0.01 to 10, or off", number(*defaults.stall_timeout_s), in_quotes(number(*defaults.stall_timeout_s))},
      {"client_limit", "Maximum number of clients", fmt::format("1 to {}", planning::kMostClients),
       number(defaults.client_limit), number(defaults.client_limit)},
      {"wait_for", "Participants that must play before frame 1", "0 to client_limit",
       number(defaults.wait_for), number(defaults.wait_for)},
      {"duration",
       "Seconds to run, counted from the first frame; the server waits for that frame as long, and 0 is no end",
       "0 to 1e9", "no end", "0"},
      {"threads", "Threads of the full simulation", fmt::format("1 to {}", kMaxThreads),
       number(defaults.choice.threads), number(defaults.choice.threads)},
      {"pipeline",
       "on: the next step is computed while a frame is encoded, if the session would not keep its rate otherwise",
       "on or off", "on", in_quotes("on")},
      {"seed", "Seed of the start block and the script", "0 to 18446744073709551615", number(defaults.seed),
       number(defaults.seed)},
      {"scripted", "Run the scene's script in the server, which then sends the inputs of simulated users",
       "true or false", "false", "false"},
      {"users", "Number of users in that script", "0 to 4294967295; 0 for the scene's", "the scene's", "0"},
      {"checkpoint_dir",
       "Folder for checkpoints of this session. The server goes on from the newest when it starts again",
       "a path; its parent must exist", "no checkpoints", in_quotes("/var/lib/tandemd/default")},
      {"checkpoint_interval", "Seconds between two checkpoints",
       fmt::format("{} to {}", checkpoint::kLeastIntervalS, checkpoint::kMostIntervalS),
       number(defaults.checkpoint.interval_s), number(defaults.checkpoint.interval_s)},
      {"checkpoint",
       "auto: start afresh where there is no good checkpoint; require: do not start then; off: neither read nor "
       "write any",
       "auto, require or off", "auto", in_quotes("auto")},
      {"standby",
       "Stand by for the session's live server: receive its checkpoints, and take over when it is gone or hands "
       "over (tandem handover). Scene, bodies and seed must be the same as there",
       "true or false", "false", "false"},
      {"standby_rank", "Of several servers that stand by, the one of the lowest rank takes over",
       fmt::format("1 to {}", kMostRank), number(defaults.standby_rank), number(defaults.standby_rank)},
      {"metrics", "Serve metrics for Prometheus at /metrics, and /healthz and /readyz",
       "ADDRESS:PORT, or a PORT of 127.0.0.1", "none", in_quotes("127.0.0.1:9730")},
      {"log_format", "How lines of the log look: for people and journald, or one JSON object each",
       std::string(logging::kFormats), "text", in_quotes("text")},
      {"log_level", "The least urgent lines that are logged", std::string(logging::kLevels), "info",
       in_quotes("info")},
      {"hash_log", "File to which a line `epoch,frame,hash` of every frame is added", "a path", "none",
       in_quotes("hashes.csv")},
  };
}

std::vector<Setting> all_settings() {
  const Options defaults;
  std::vector<Setting> all;
  for (auto part : {session_settings(defaults), stream_settings(defaults), service_settings(defaults)})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace

const std::vector<Setting>& settings() {
  static const std::vector<Setting> all = all_settings();
  return all;
}

const Setting* find_setting(std::string_view field) {
  const auto found = std::ranges::find(settings(), field, &Setting::field);
  return found == settings().end() ? nullptr : &*found;
}

std::string text_of(const Setting& setting) {
  const std::string otherwise = setting.otherwise.empty() ? "" : fmt::format(" [{}]", setting.otherwise);
  return fmt::format("{}: {}{}", setting.help, setting.takes, otherwise);
}

std::string flag_of(std::string_view field) {
  if (field == "budget_bytes") return "--budget";
  if (field == "threshold_auto") return "--threshold";
  std::string flag = fmt::format("--{}", field);
  std::ranges::replace(flag, '_', '-');
  return flag;
}

}  // namespace tandem::daemon
