// tandem::Server: a Host with a clock, a DDS port and the thread that sends.
#include "tandem/host.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/transport/clock.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/limits.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/host/streams/groups.hpp"

namespace tandem {
namespace {

using transport::steady_ns;
using transport::wall_ns;

// Nothing, where it is no number.
std::int64_t to_ns(double seconds, double most) {
  return seconds > 0 ? static_cast<std::int64_t>(std::min(seconds, most) * 1e9) : 0;
}

Result<void> choose_turns(const ServerOptions& options, bool turns, const CodecTraits& traits,
                          host::StreamConfig& stream) {
  std::vector<host::BodySize> sizes;
  for (const ServedType& type : options.types) sizes.push_back({type.name, type.radius});
  if (auto chosen = host::choose_groups(turns, sizes, stream.lattice, traits, stream.layout); !chosen)
    return chosen;
  const Groups groups = groups_of(stream.layout);
  if (traits.takes_tables) stream.layout.codec_tables = default_code_tables(groups);
  if (!traits.reads_steps || !groups.orientation) return {};
  const double smallest = std::ranges::min(sizes, {}, &host::BodySize::radius).radius;
  return host::set_turn_steps(stream.lattice, 0, 0, smallest, stream.layout.parameters.codec);
}

Result<host::StreamConfig> plan(const ServerOptions& options, const engine::Simulation& simulation) {
  const auto traits = codec_traits(options.codec);
  if (!traits) return tl::unexpected(traits.error());
  const bool automatic = options.target_mbit_per_s != 0;  // what is no number is refused with its goal
  const double finest = automatic ? options.threshold * host::kFinestShare : options.threshold;
  const auto lattice = host::choose_lattice(finest, options.extent, simulation.dt_s());
  if (!lattice) return tl::unexpected(lattice.error());
  const auto parameters = host::codec_parameters(*lattice, options.threshold, 0, 0);
  if (!parameters) return tl::unexpected(parameters.error());
  host::StreamConfig stream;
  stream.lattice = *lattice;
  stream.layout.capacity = simulation.capacity();
  stream.layout.type_count = static_cast<TypeId>(options.types.size());
  stream.layout.lead = options.lead;
  stream.layout.codec = options.codec;
  stream.layout.parameters.codec = *parameters;
  if (automatic) {
    stream.quality = host::quality_goal(*lattice, options.target_mbit_per_s, finest,
                                        options.threshold * host::kCoarsestShare);
  }
  const bool turns = !simulation.bodies().orientation[0].empty();
  if (auto chosen = choose_turns(options, turns, *traits, stream); !chosen)
    return tl::unexpected(chosen.error());
  if (traits->takes_budget) stream.budget = traits->usual_budget;
  if (traits->reads_gains) {
    if (auto gained = host::choose_gains(stream); !gained) return tl::unexpected(gained.error());
  }
  return stream;
}

Result<host::HostConfig> configure(const ServerOptions& options, const engine::Simulation& simulation) {
  if (options.types.empty() || options.types.size() > transport::kMaxTypes)
    return fail(ErrorCode::kInvalidArgument, "a server needs 1 to 65535 body types");
  return plan(options, simulation).map([&](host::StreamConfig&& stream) {
    host::HostConfig config;
    config.streams.push_back(std::move(stream));
    config.session = options.session;
    config.epoch = static_cast<Epoch>(wall_ns() / kMillisecond);
    config.frame_rate_hz = 1 / simulation.dt_s();
    config.wait_for = options.wait_for;
    config.clock_ns = &steady_ns;
    config.scene = options.scene;
    config.scene_description = options.scene_description;
    config.types.clear();
    for (const ServedType& type : options.types) {
      config.types.push_back({.name = type.name,
                              .radius = static_cast<float>(type.radius),
                              .colour_rgba = type.colour_rgba,
                              .shape = type.shape,
                              .shape_values = type.shape_values});
    }
    return config;
  });
}

}  // namespace

struct Server::Impl {
  Impl(const ServerOptions& options, std::unique_ptr<transport::ServerPort> the_port,
       std::unique_ptr<host::Host> the_host)
      : log(options.log),
        port(std::move(the_port)),
        host(std::move(the_host)),
        publisher(host->outbox(), *port) {}
  ~Impl() { publisher.flush(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  [[nodiscard]] bool over() const {
    return host->state() == host::Host::State::kRefused || host->state() == host::Host::State::kEnded;
  }
  bool poll(std::int64_t longest_ns) {
    if (polling) {
      error = {ErrorCode::kOutOfOrder, "poll() was called by the simulation or the log, inside poll()"};
      return false;
    }
    polling = true;
    const bool goes_on = poll_once(longest_ns);
    polling = false;
    return goes_on;
  }
  bool poll_once(std::int64_t longest_ns) {
    if (over() || publisher.gave_up()) return false;
    host->poll(steady_ns(), wall_ns());
    for (const std::string& line : host->take_notices())
      if (log) log(line);
    if (over()) {
      error = host->error().value_or(error);
      return false;
    }
    if (publisher.gave_up()) {
      error = {ErrorCode::kTransport, "a frame could not be written for 10 s: " + publisher.last_failure()};
      return false;
    }
    const std::int64_t wait_ns = std::min(longest_ns, host->next_wake_ns() - steady_ns());
    if (wait_ns > 0) port->wait(std::chrono::nanoseconds(wait_ns));
    return true;
  }

  std::function<void(std::string_view)> log;
  std::unique_ptr<transport::ServerPort> port;
  std::unique_ptr<host::Host> host;
  host::Publisher publisher;  // last: it stops before what it writes to is gone
  bool polling = false;
  Error error{ErrorCode::kOutOfOrder, "the session goes on"};
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Result<Server> Server::start(const ServerOptions& options, engine::Simulation& simulation) {
  auto config = configure(options, simulation);
  if (!config) return tl::unexpected(config.error());
  const auto largest = host::largest_delta_bytes(config->streams);
  if (!largest) return tl::unexpected(largest.error());
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.session = options.session;
  dds.delta_depth = transport::delta_depth(config->frame_rate_hz, config->window_ceiling, *largest);
  auto port = transport::make_dds_server_port(dds);
  if (!port) return tl::unexpected(port.error());
  auto host = host::Host::create(std::move(*config), simulation, **port);
  if (!host) return tl::unexpected(host.error());
  return Server(std::make_unique<Impl>(options, std::move(*port), std::move(*host)));
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
  static const Error kMovedFrom{ErrorCode::kOutOfOrder, "the server was moved from"};
  return impl_ == nullptr ? kMovedFrom : impl_->error;
}

Result<std::uint64_t> Server::inject(const engine::Input& input) {
  if (impl_ == nullptr) return tl::unexpected(error());
  return impl_->host->inject(input);
}

ServerStatus Server::status() const {
  if (impl_ == nullptr) return {};
  const host::Host& host = *impl_->host;
  const host::HostTotals totals = host.totals();
  ServerStatus status;
  const ServerCounts& counts = totals;
  static_cast<ServerCounts&>(status) = counts;
  status.frame = host.frame();
  status.state_hash = host.hash();
  status.participants = host.participants();
  status.observers = host.observers();
  status.payload_bytes = totals.payload_bytes;
  status.corrected = totals.corrected;
  status.threshold = host.threshold_m();
  status.frame_ms_p50 = totals.frame_ms_p50;
  status.frame_ms_p99 = totals.frame_ms_p99;
  return status;
}

}  // namespace tandem
