// Implements tandem::Server: a Host with a clock, a DDS port and a thread that sends.
#include "tandem/host.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <string_view>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/network/reach.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/host.hpp"
#include "services/host/keeping/keeping.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/host/planning/plan.hpp"
#include "services/host/waiting.hpp"

namespace tandem {
namespace {

using transport::steady_ns;
using transport::wall_ns;

// Converts seconds to nanoseconds; 0 if the value is not a number.
std::int64_t to_ns(double seconds, double most) {
  return seconds > 0 ? static_cast<std::int64_t>(std::min(seconds, most) * 1e9) : 0;
}

planning::PlannedWorld world_of(const ServerOptions& options, const engine::Simulation& simulation) {
  planning::PlannedWorld world{.name = options.scene,
                               .scene_json = options.scene_json,
                               .capacity = simulation.capacity(),
                               .dt_s = simulation.dt_s(),
                               .extent = options.extent,
                               .threshold = options.threshold,
                               .turns = !simulation.bodies().orientation[0].empty(),
                               .up_axis = static_cast<transport::UpAxis>(options.up_axis),
                               .types = {},
                               .scenery = options.scenery,
                               .trained = {}};
  const engine::NewsFeatures own = simulation.tells();
  world.tells = {.keys = options.keys || own.keys, .events = options.events || own.events};
  for (const ServedType& type : options.types) {
    world.types.push_back({.name = type.name,
                           .bounding_radius = type.radius,
                           .contact_radius = type.contact_radius != 0 ? type.contact_radius : type.radius,
                           .mass = type.mass,
                           .colour_rgba = type.colour_rgba,
                           .shape = type.shape,
                           .shape_values = type.shape_values});
  }
  return world;
}

Result<planning::Wishes> wishes_of(const ServerOptions& options) {
  planning::Wishes wishes;
  wishes.codec = options.codec;
  wishes.predictor = options.predictor;
  wishes.automatic = options.automatic_threshold || options.target_mbit_per_s != 0;
  wishes.target_mbit_per_s = options.target_mbit_per_s;
  if (options.max_error != 0) wishes.max_error_m = options.max_error;
  if (options.budget_bytes != 0) wishes.budget_bytes = options.budget_bytes;
  wishes.delays_s = options.delivery_delays_s;
  wishes.threads = options.threads;
  for (const std::string& text : options.streams) {
    auto stream = planning::read_stream(text);
    if (!stream) return tl::unexpected(stream.error());
    wishes.streams.push_back(std::move(*stream));
  }
  return wishes;
}

planning::ServiceWishes service_of(const ServerOptions& options) {
  planning::ServiceWishes service;
  service.session = options.session;
  service.lead = options.lead;
  service.client_limit = options.client_limit;
  service.wait_for = options.wait_for;
  service.window = options.window;
  if (options.rate_hz != 0) service.rate_hz = options.rate_hz;
  service.free_rate = options.free_rate;
  service.stall_timeout_s = options.stall_timeout_s;
  return service;
}

// The planner speaks of tandemd's flags.
Error in_words_of_options(Error error) {
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"--threshold auto", "automatic_threshold"},
      {"an automatic threshold", "automatic_threshold"},
      {"target-bandwidth", "target_mbit_per_s"},
      {"max-error", "max_error"},
      {"client-limit", "client_limit"},
      {"wait-for", "wait_for"},
      {"stall-timeout", "stall_timeout_s"},
      {"rate:", "rate_hz:"},
      {"budget:", "budget_bytes:"},
      {"delivery-delay:", "delivery_delays_s:"},
  };
  const bool of_stream = error.message.starts_with("stream ") || error.message.starts_with("'");
  for (const auto& [flag, option] : kWords) {
    if (const std::size_t at = error.message.find(flag); at != std::string::npos && !of_stream)
      error.message.replace(at, flag.size(), option);
  }
  return error;
}

Result<host::HostConfig> configure(const ServerOptions& options, const engine::Simulation& simulation) {
  if (options.types.empty() || options.types.size() > transport::kMaxTypes)
    return fail(ErrorCode::kInvalidArgument, "a server needs 1 to 65535 body types");
  auto config =
      wishes_of(options)
          .and_then([&](const planning::Wishes& wishes) {
            return planning::plan_server(world_of(options, simulation), wishes, service_of(options));
          })
          .map_error(&in_words_of_options);
  const auto data = parse_data_fields(options.data);
  if (config && !data) return tl::unexpected(data.error());
  if (!config) return config;
  for (host::StreamConfig& stream : config->streams) {
    if (data->empty() || !stream.has_data) continue;
    stream.layout.data = *data;
    stream.layout.groups.emplace_back(kDataGroup);
  }
  return config;
}

std::string text_of(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& error) {
    return std::string("the simulation threw an exception: ") + error.what();
  } catch (...) {
    return "the simulation threw something that is no std::exception";
  }
}

}  // namespace

struct Server::Impl {
  Impl(const ServerOptions& options, host::Keeping the_keeping,
       std::unique_ptr<transport::ServerPort> the_port, std::unique_ptr<host::Host> the_host)
      : log(options.log),
        keeping(std::move(the_keeping)),
        port(std::move(the_port)),
        host(std::move(the_host)),
        publisher(host->outbox(), *port) {}
  ~Impl() {
    if (!broken) {
      host->tell_collected_frames();
      keeping.end(*host);
    }
    publisher.flush();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] bool over() const {
    return host->state() == host::Host::State::kRefused || host->state() == host::Host::State::kEnded ||
           host->state() == host::Host::State::kHandedOver;
  }
  bool poll(std::int64_t longest_ns) {
    if (polling) {
      error = {ErrorCode::kOutOfOrder, "poll() was called by the simulation or the log, inside poll()"};
      return false;
    }
    polling = true;
    bool goes_on = false;
    try {
      goes_on = poll_once(longest_ns);
    } catch (...) {
      broken = true;
      error = {ErrorCode::kIo, text_of(std::current_exception())};
    }
    polling = false;
    return goes_on;
  }
  bool poll_once(std::int64_t longest_ns) {
    if (broken || over() || publisher.gave_up()) return false;
    const std::int64_t now_ns = steady_ns();
    const bool produced = host->poll(now_ns, wall_ns());
    keeping.after_poll(*host, produced, now_ns);
    for (const auto& lines : {host->take_warnings(), host->take_notices()})
      for (const std::string& line : lines)
        if (log) log(line);
    tell_network(now_ns);
    if (over()) {
      if (host->state() == host::Host::State::kHandedOver)
        error = {ErrorCode::kConflict, "the session was handed over to a server that stood by"};
      error = host->error().value_or(error);
      return false;
    }
    if (publisher.gave_up()) {
      error = {ErrorCode::kTransport, "a frame could not be written for 10 s: " + publisher.last_failure()};
      return false;
    }
    const std::int64_t wait_ns = std::min(longest_ns, host->next_wake_ns() - steady_ns());
    host::wait_for_work(*host, *port, std::chrono::nanoseconds(wait_ns));
    return true;
  }

  // Thread-safe, as the host's desk is.
  [[nodiscard]] host::NewsDesk& news() {
    host::NewsDesk* const own = host->news();
    return own != nullptr ? *own : no_news;
  }

  // The application decides whether the server is to be started anew.
  void tell_network(std::int64_t now_ns) {
    if (!log || now_ns < look_ns) return;
    look_ns = now_ns + kSecond;
    std::string line;
    static_cast<void>(transport::dds_server_network(&line));
    if (line == std::exchange(network, line)) return;
    log(line.empty() ? "the network address that DDS is bound to is back" : line + ", and nobody can join");
  }

  std::function<void(std::string_view)> log;
  host::Keeping keeping;
  std::unique_ptr<transport::ServerPort> port;
  std::unique_ptr<host::Host> host;
  host::Publisher publisher;      // after outbox and port, as it stops before they are destroyed
  host::NewsDesk no_news{{}, 0};  // of a session without: refuses all
  bool polling = false;
  std::string network;  // what was told of it last
  std::int64_t look_ns = 0;
  bool broken = false;  // by an exception: nobody knows what of the simulation is whole
  Error error{ErrorCode::kOutOfOrder, "the session goes on"};
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Result<Server> Server::start(const ServerOptions& options, engine::Simulation& simulation) try {
  auto config = configure(options, simulation);
  if (!config) return tl::unexpected(config.error());
  const auto largest = host::largest_delta_bytes(config->streams);
  if (!largest) return tl::unexpected(largest.error());
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.session = options.session;
  dds.secure = options.secure;
  dds.delta_depth = transport::delta_depth(config->frame_rate_hz, config->window_ceiling, *largest);
  auto keeping = host::Keeping::begin(
      {options.checkpoint_dir, options.checkpoint_interval_s, options.checkpoint_required}, simulation,
      *config,
      [log = options.log](const std::string& line, bool /*warning*/) {
        if (log) log(line);
      },
      &steady_ns);
  if (!keeping) return tl::unexpected(keeping.error());
  auto port = transport::make_dds_server_port(dds);
  if (!port) return tl::unexpected(port.error());
  const std::string warning = transport::warning_without_security(options.profile, options.secure);
  if (options.log && !warning.empty()) options.log(warning);
  auto host = host::Host::create(std::move(*config), simulation, **port);
  if (!host) return tl::unexpected(host.error());
  return Server(std::make_unique<Impl>(options, std::move(*keeping), std::move(*port), std::move(*host)));
} catch (...) {
  return fail(ErrorCode::kIo, text_of(std::current_exception()));
}

bool Server::poll(double wait_s) { return impl_ != nullptr && impl_->poll(to_ns(wait_s, 1)); }

bool Server::run_for(double seconds) {
  if (impl_ == nullptr) return false;
  const std::int64_t end_ns = steady_ns() + to_ns(seconds, 1e9);
  for (std::int64_t left_ns = end_ns - steady_ns(); left_ns > 0; left_ns = end_ns - steady_ns())
    if (!impl_->poll(left_ns)) return false;
  return true;
}

const Error& Server::error() const {
  static const Error moved_from{ErrorCode::kOutOfOrder, "the server was moved from"};
  return impl_ == nullptr ? moved_from : impl_->error;
}

Result<std::uint64_t> Server::inject(const engine::Input& input) {
  if (impl_ == nullptr) return tl::unexpected(error());
  return impl_->host->inject(input);
}

Result<void> Server::set_key(std::string_view key, std::span<const std::byte> value) {
  if (impl_ == nullptr) return tl::unexpected(error());
  return impl_->news().set_key(key, value);
}

Result<void> Server::remove_key(std::string_view key) {
  if (impl_ == nullptr) return tl::unexpected(error());
  return impl_->news().remove_key(key);
}

Result<void> Server::broadcast(std::uint32_t kind, std::span<const std::byte> bytes,
                               std::optional<std::uint32_t> slot) {
  if (impl_ == nullptr) return tl::unexpected(error());
  return impl_->news().broadcast(kind, bytes, slot);
}

ServerStatus Server::status() const {
  if (impl_ == nullptr) return {};
  const host::Host& host = *impl_->host;
  const host::HostTotals totals = host.totals();
  ServerStatus status;
  static_cast<ServerCounts&>(status) = totals;
  status.frame = host.frame();
  status.state_hash = host.hash();
  status.participants = host.participants();
  status.observers = host.observers();
  status.payload_bytes = totals.payload_bytes;
  status.corrected = totals.corrected;
  status.hidden = totals.hidden;
  status.threshold = host.threshold_m();
  status.frame_ms_p50 = totals.frame_ms_p50;
  status.frame_ms_p99 = totals.frame_ms_p99;
  status.continues_epoch = host.session().continues_epoch;
  status.continues_frame = host.session().continues_frame;
  if (const auto figures = impl_->keeping.figures()) {
    status.checkpoints = figures->written;
    status.checkpoint_age_s = figures->age_s;
  }
  return status;
}

}  // namespace tandem
