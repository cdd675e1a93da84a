#include "services/tandemd/configuration/config.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <sys/stat.h>

#include <fstream>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/port.hpp"
#include "services/engines/door/process.hpp"
#include "services/host/host.hpp"
#include "services/program/configuration/common.hpp"
#include "services/program/configuration/file.hpp"
#include "services/program/number.hpp"
#include "services/tandemd/configuration/form.hpp"
#include "tandem/simulation.hpp"

namespace tandem::daemon {
namespace {

using idl::ServerConfig;

tl::unexpected<Error> refuse(const char* flag, const std::string& what) {
  return fail(ErrorCode::kInvalidArgument, fmt::format("--{}: {}", flag, what));
}

/// The planner's error begins with the name of an option, which is a flag here.
tl::unexpected<Error> refuse(const Error& error) { return fail(error.code, "--" + error.message); }

Result<void> read_service(const ServerConfig& config, DaemonOptions& options) {
  options.session = config.session();
  options.lead = config.lead();
  options.client_limit = config.client_limit();
  options.wait_for = config.wait_for();
  // A part of a frame becomes a number that check_service() refuses.
  if (config.window() != "auto") options.window = text::number<std::uint32_t>(config.window()).value_or(0);
  options.free_rate = config.rate() == "max";
  if (config.has_rate() && !options.free_rate) options.rate_hz = text::number<double>(config.rate());
  options.stall_timeout_s = text::number<double>(config.stall_timeout());  // empty: off
  options.pipeline = config.pipeline() == "on";
  if (const auto named = transport::check_session_name(options.session); !named)
    return refuse("session", named.error().message);
  if (const auto good = planning::check_service(options); !good) return refuse(good.error());
  return {};
}

Result<void> read_standby(const ServerConfig& given, const ServerConfig& config, DaemonOptions& options) {
  options.standby = config.standby();
  options.standby_rank = config.standby_rank();
  if (given.has_standby_rank() && !options.standby) return refuse("standby-rank", "needs --standby");
  if (options.standby && options.checkpoint.required)
    return refuse("standby",
                  "conflicts with --checkpoint require: a server that stands by goes on from the live one");
  return {};
}

/// Reads where an engine on another machine comes, and what it has to show.
Result<void> read_network(const ServerConfig& config, engine::door::Way& way) {
  if (config.has_engine_token() && !config.has_engine_listen())
    return refuse("engine-token", "needs engine-listen: only an engine on another machine shows a token");
  if (!config.has_engine_listen()) return {};
  const auto address = metrics::read_address(config.engine_listen());
  if (!address) return refuse("engine-listen", address.error().message);
  way.host = address->host;
  way.port = address->port;
  if (!config.has_engine_token()) {
    if (config.has_engine()) return {};  // its command gets one
    return refuse("engine-listen", "needs engine-token, because anybody can connect");
  }
  const std::string& path = config.engine_token();
  struct stat there {};
  std::ifstream file(path);
  if (!file || ::stat(path.c_str(), &there) != 0) return refuse("engine-token", path + ": cannot be read");
  // A group may: what systemd hands over is readable by root's group.
  if ((there.st_mode & 0006U) != 0)
    return refuse("engine-token",
                  fmt::format("{}: everybody can read or write it: chmod 600 {}", path, path));
  std::getline(file, way.token);
  if (const std::string wrong = engine::door::wrong_with_token(way.token); !wrong.empty())
    return refuse("engine-token", fmt::format("{}: {}", path, wrong));
  return {};
}

/// The command of an engine: what was given, or tandem-imd for the address of a simulation that speaks IMD.
std::string engine_command(const ServerConfig& config) {
  if (!config.engine().starts_with("imd://")) return config.engine();
  return fmt::format("exec tandem-imd {} --topology {}", engine::door::quoted(config.engine()),
                     engine::door::quoted(config.topology()));
}

/// Reads how an engine in another process comes, and refuses what belongs to a scene.
Result<void> read_engine(const ServerConfig& config, DaemonOptions& options) {
  const bool by_command_or_network = config.has_engine() || config.has_engine_listen();
  const int ways = (by_command_or_network ? 1 : 0) + (config.has_engine_socket() ? 1 : 0) +
                   (config.has_engine_fd() ? 1 : 0);
  const char* const flag = config.has_engine()          ? "engine"
                           : config.has_engine_listen() ? "engine-listen"
                           : config.has_engine_socket() ? "engine-socket"
                                                        : "engine-fd";
  const bool imd = config.engine().starts_with("imd://");
  if (config.has_topology() && !imd) return refuse("topology", "belongs to --engine imd://HOST:PORT");
  if (config.has_topology() && !std::ifstream(config.topology()))
    return refuse("topology", config.topology() + ": cannot be read");
  engine::door::Way way{.command = engine_command(config),
                        .path = config.engine_socket(),
                        .descriptor = config.has_engine_fd() ? static_cast<int>(config.engine_fd()) : -1};
  if (auto good = read_network(config, way); !good) return good;
  if (ways == 0) return {};
  if (imd && config.topology().empty())
    return refuse("topology", "imd:// needs a file that says what the atoms are");
  if (ways > 1)
    return refuse(
        flag,
        "an engine comes in one way: give only one of engine (which may have engine-listen), engine-listen, "
        "engine-socket and engine-fd");
  if (config.has_scene() || config.has_bodies())
    return refuse(flag, "the engine says what it simulates: leave out scene and bodies");
  if (config.scripted() || config.has_users()) return refuse(flag, "only scenes have scripts");
  options.engine = std::move(way);
  return {};
}

Result<void> read_checkpoint(const ServerConfig& config, DaemonOptions& options) {
  checkpoint::Settings& settings = options.checkpoint;
  settings.required = config.checkpoint() == "require";
  if (settings.required && config.checkpoint_dir().empty())
    return refuse("checkpoint", "require needs --checkpoint-dir");
  if (config.checkpoint() != "off") settings.folder = config.checkpoint_dir();
  settings.interval_s = config.checkpoint_interval();
  return {};
}

Result<void> check_names(const planning::Wishes& wishes) {
  if (const auto known = codec_traits(wishes.codec); !known) return refuse("codec", known.error().message);
  if (const auto known = planning::check_known_predictor(wishes.predictor); !known)
    return refuse("predictor", known.error().message);
  return {};
}

/// Checks which of threshold, automatic quality and budget can be combined.
Result<void> check_quality(const ServerConfig& config, const sessions::SessionChoice& choice) {
  if (choice.threshold_m && config.has_threshold_scale())
    return refuse("threshold-scale", "cannot be combined with --threshold");
  if (const auto good = planning::check_wishes(choice); !good) return refuse(good.error());
  return {};
}

const google::protobuf::FieldDescriptor* field_of(const planning::StreamOption& option) {
  return idl::Stream::descriptor()->FindFieldByName(std::string(option.file_field));
}

planning::StreamWishes wishes_of(const idl::Stream& stream) {
  planning::StreamWishes wishes{.name = stream.name()};
  for (const planning::StreamOption& option : planning::kStreamOptions) {
    const google::protobuf::FieldDescriptor* const field = field_of(option);
    if (configuration::is_set(*field, stream))
      wishes.settings.emplace_back(option.key, configuration::text_of(*field, stream));
  }
  return wishes;
}

Result<void> check_streams(const ServerConfig& config, const sessions::SessionChoice& choice) {
  if (config.stream_size() == 0) return {};
  std::vector<host::StreamConfig> names;
  for (const idl::Stream& stream : config.stream()) {
    if (stream.has_predictor() && config.has_predictor() && stream.predictor() != config.predictor()) {
      return refuse("predictor",
                    fmt::format("{} conflicts with --stream {}, which sets {}; set it there only",
                                config.predictor(), stream.name(), stream.predictor()));
    }
    const auto good = planning::wishes_of(choice, wishes_of(stream)).and_then(check_names);
    if (!good) {
      std::string what = good.error().message;
      if (what.starts_with("--")) what.erase(0, 2);  // in a stream it is no flag
      return refuse("stream", fmt::format("{}: {}", stream.name(), what));
    }
    names.emplace_back();
    names.back().name = stream.name();
  }
  if (names.front().name.empty()) return refuse("stream", "every stream needs a name");
  if (auto named = host::check_stream_names(names); !named) return refuse("stream", named.error().message);
  return {};
}

sessions::SessionChoice choice_of(const ServerConfig& config) {
  sessions::SessionChoice choice;
  choice.bodies = config.bodies();
  choice.codec = config.codec();
  choice.predictor = config.predictor();
  if (config.has_threshold()) choice.threshold_m = config.threshold();
  choice.threshold_scale = config.threshold_scale();
  choice.automatic = config.threshold_auto();
  choice.target_mbit_per_s = config.target_bandwidth();
  if (config.has_max_error()) choice.max_error_m = config.max_error();
  if (config.has_budget_bytes()) choice.budget_bytes = config.budget_bytes();
  choice.delays_s.assign(config.delivery_delay().begin(), config.delivery_delay().end());
  if (config.has_cap()) choice.cap_kbit_s = config.cap();
  choice.threads = config.threads();
  for (const idl::Stream& stream : config.stream()) choice.streams.push_back(wishes_of(stream));
  return choice;
}

}  // namespace

Result<idl::Stream> parse_stream(const std::string& text) {
  const auto wishes = planning::read_stream(text);
  if (!wishes) return tl::unexpected(wishes.error());
  idl::Stream stream;
  stream.set_name(wishes->name);
  for (const planning::StreamOption& option : planning::kStreamOptions) {
    for (const auto& [key, value] : wishes->settings) {
      if (key == option.key && !configuration::set_text(*field_of(option), value, stream))
        return fail(ErrorCode::kInvalidArgument, fmt::format("'{}': '{}' is no {}", text, value, key));
    }
  }
  return stream;
}

void displace(const ServerConfig& flags, ServerConfig& file) {
  // A length, a scale and auto exclude each other,
  // quality follows auto, and auto and a budget need codecs that have them.
  const CodecTraits traits = planning::traits_of(flags.codec());
  const bool was_automatic = file.threshold_auto();
  if (flags.has_threshold() || flags.has_threshold_auto() || flags.has_threshold_scale())
    file.clear_threshold();
  if (flags.has_threshold()) file.clear_threshold_scale();
  if (flags.has_threshold() || !traits.reads_threshold) file.clear_threshold_auto();
  if (!traits.takes_budget) {
    file.clear_budget_bytes();
    file.clear_cap();
  }
  // A predictor replaces the streams, because they differ by theirs.
  if (flags.has_predictor()) file.clear_stream();
  if (flags.stream_size() > 0) file.clear_predictor();
  // What follows from a mistake of the file's own is not dropped, but told.
  if (was_automatic && !(flags.has_threshold_auto() ? flags.threshold_auto() : file.threshold_auto())) {
    file.clear_target_bandwidth();
    file.clear_max_error();
  }
}

ServerConfig merge(const ServerConfig& flags, ServerConfig file) {
  displace(flags, file);
  configuration::merge(flags, file);
  return file;
}

Result<ConfigFile> parse_config(const std::string& text, const std::string& path) {
  ConfigFile file;
  auto places = configuration::parse(form(), "tandemd", text, path, file.config);
  if (!places) return tl::unexpected(places.error());
  file.places = std::move(*places);
  return file;
}

Result<ConfigFile> load_config(const std::string& path) {
  return configuration::read_text(path).and_then(
      [&path](const std::string& text) { return parse_config(text, path); });
}

namespace {

/// `given`: what flags and file say, without defaults.
Result<DaemonOptions> checked(const ServerConfig& given) {
  DaemonOptions options;
  if (auto good = configuration::check_values(form(), given); !good) return tl::unexpected(good.error());
  if (auto good = read_engine(given, options); !good) return tl::unexpected(good.error());
  if (!options.engine && !given.has_scene()) return refuse("scene", "give a scene's name or file");
  if (!options.engine && !given.has_bodies()) return refuse("bodies", "give the number of bodies");
  ServerConfig config = given;
  configuration::complete(form(), config);
  options.scene = config.scene();
  options.choice = choice_of(config);
  options.seed = config.seed();
  options.scripted = config.scripted();
  options.users = config.users();
  options.domain = config.domain();
  options.secure = config.secure();
  options.profile = config.profile();
  if (!options.profile.empty()) {
    if (const auto good = transport::parse_profile(options.profile, transport::Side::kServer); !good)
      return refuse("profile", good.error().message);
  }
  if (config.duration() != 0) options.duration_s = config.duration();
  options.hash_log = config.hash_log();
  options.log = configuration::log_of(config);
  auto address = configuration::metrics_of(config);
  if (!address) return tl::unexpected(address.error());
  options.metrics = std::move(*address);
  return read_service(config, options)
      .and_then([&] { return read_checkpoint(config, options); })
      .and_then([&] { return read_standby(given, config, options); })
      .and_then([&] { return check_names(options.choice); })
      .and_then([&] { return check_quality(given, options.choice); })
      .and_then([&] { return check_streams(given, options.choice); })
      .map([&] { return options; });
}

}  // namespace

Result<DaemonOptions> check_config(const ServerConfig& config, const configuration::Places& places) {
  auto options = checked(config);
  if (!options) return tl::unexpected(placed(places, options.error()));
  options->places = places;
  return options;
}

}  // namespace tandem::daemon
