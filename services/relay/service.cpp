#include "services/relay/service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <array>
#include <chrono>
#include <random>
#include <thread>
#include <utility>

#include "sdk/client/api/client_id.hpp"
#include "sdk/client/api/clock.hpp"
#include "sdk/transport/clock.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/doorbell.hpp"
#include "sdk/transport/nats/nats_client_port.hpp"
#include "sdk/transport/nats/nats_server_port.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/metrics/endpoint.hpp"
#include "services/metrics/health.hpp"
#include "services/metrics/latest.hpp"
#include "services/process/service_notifier.hpp"
#include "services/relay/metrics.hpp"
#include "services/relay/relay.hpp"

namespace tandem::relay {
namespace {

using transport::steady_ns;
using transport::wall_ns;

/// Waits for a port in a thread of its own, so that one thread can work for many.
class PortWatch {
 public:
  template <class Port>
  PortWatch(Port& port, transport::Doorbell& bell)
      : wake_([&port] { port.wake(); }), thread_([&port, &bell](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            port.wait(std::chrono::milliseconds(500));
            bell.ring();
          }
        }) {}
  ~PortWatch() {
    thread_.request_stop();
    wake_();
  }
  PortWatch(const PortWatch&) = delete;
  PortWatch& operator=(const PortWatch&) = delete;
  PortWatch(PortWatch&&) = delete;
  PortWatch& operator=(PortWatch&&) = delete;

 private:
  std::function<void()> wake_;
  std::jthread thread_;  // last, so that it ends first
};

template <class Port>
WatchedPort<Port> watched(std::unique_ptr<Port> port, transport::Doorbell& bell) {
  auto watch = std::make_shared<PortWatch>(*port, bell);
  return {std::move(port), std::move(watch)};
}

void log_line(LogLevel level, std::string_view line) {
  constexpr std::array kLevels{spdlog::level::info, spdlog::level::warn, spdlog::level::err};
  spdlog::log(kLevels[static_cast<std::size_t>(level)], line);
}

class Service final : private Relay::Publishing {
 public:
  Service(const Options& options, SignalWatch& signals)
      : options_(options), signals_(signals), sender_(std::random_device()()) {}

  int run();

 private:
  Result<WatchedPort<transport::ClientPort>> follow(transport::ClientId id);
  Result<WatchedPort<transport::ServerPort>> publish(const transport::SessionMessage& session);
  [[nodiscard]] Result<std::unique_ptr<transport::NatsBus>> connect(const Side& side) const;
  [[nodiscard]] transport::NatsPortOptions nats_options(transport::ClientId id) const;
  void opened(host::Host& host, transport::ServerPort& port) override {
    logging::set_context(options_.session, host.session().epoch);
    publisher_.emplace(host.outbox(), port);
  }
  void closing() override {
    publisher_->flush();
    publisher_.reset();
  }
  std::string failure() override {
    return publisher_ && publisher_->gave_up()
               ? "a frame could not be written for 10 s: " + publisher_->last_failure()
               : std::string();
  }
  void watch(Relay& relay);

  const Options& options_;
  SignalWatch& signals_;
  const std::uint32_t sender_;
  transport::Doorbell bell_;
  std::optional<host::Publisher> publisher_;
  std::vector<transport::ClientStatusMessage> reports_;
  std::string trouble_;  // with NATS, as it was told last
  std::int64_t next_figures_ns_ = 0;
  metrics::ClientWatch client_watch_;
  metrics::Latest<FiguresNow> latest_;
  metrics::Health health_;
  ServiceNotifier notifier_;
};

Result<std::unique_ptr<transport::NatsBus>> Service::connect(const Side& side) const {
  return transport::make_nats_bus({.url = side.url,
                                   .name = "tandem-relay " + options_.session,
                                   .credentials = side.credentials,
                                   .tls_ca = side.tls_ca});
}

transport::NatsPortOptions Service::nats_options(transport::ClientId id) const {
  return {.session = options_.session,
          .site = options_.site,
          .client = id,
          .sender = sender_,
          .clock = steady_ns,
          .log_bytes = options_.log_bytes};
}

Result<WatchedPort<transport::ClientPort>> Service::follow(transport::ClientId id) {
  std::unique_ptr<transport::ClientPort> made;
  if (options_.from.is_dds()) {
    transport::DdsOptions dds;
    dds.domain = options_.domain;
    dds.profile = options_.profile;
    dds.session = options_.session;
    dds.secure = options_.secure;
    dds.client = id;
    dds.stop = &signals_.stop();
    auto port = transport::make_dds_client_port(dds);
    if (!port) return tl::unexpected(port.error());
    made = std::move(*port);
  } else {
    auto bus = connect(options_.from);
    if (!bus) return tl::unexpected(bus.error());
    made = std::make_unique<transport::NatsClientPort>(nats_options(id), std::move(*bus));
  }
  return watched(std::move(made), bell_);
}

Result<WatchedPort<transport::ServerPort>> Service::publish(const transport::SessionMessage& session) {
  std::unique_ptr<transport::ServerPort> made;
  if (options_.to.is_dds()) {
    transport::DdsOptions dds;
    dds.domain = options_.domain;
    dds.profile = options_.profile;
    dds.session = options_.session;
    dds.secure = options_.secure;
    dds.stop = &signals_.stop();
    for (const transport::StreamMessage& stream : session.streams)
      dds.delta_depth = std::max(dds.delta_depth,
                                 transport::delta_depth(session.frame_rate_hz, 24, stream.max_delta_bytes));
    auto port = transport::make_dds_server_port(dds);
    if (!port) return tl::unexpected(port.error());
    made = std::move(*port);
  } else {
    auto bus = connect(options_.to);
    if (!bus) return tl::unexpected(bus.error());
    made = std::make_unique<transport::NatsServerPort>(nats_options(0), std::move(*bus));
  }
  return watched(std::move(made), bell_);
}

// Hands over figures a few times a second, because a scrape must not wait for the work.
void Service::watch(Relay& relay) {
  const std::int64_t now_ns = steady_ns();
  auto* const nats = dynamic_cast<transport::NatsServerPort*>(relay.port());
  // The port that follows tells its client of its troubles, which logs them.
  std::string trouble = nats == nullptr ? std::string() : nats->trouble();
  if (trouble != trouble_ && !trouble.empty()) spdlog::warn("{}", trouble);
  trouble_ = std::move(trouble);
  health_.beat(now_ns, trouble_.empty() ? relay.obstacle()
                                        : "the NATS server cannot be reached, or does not permit it");
  notifier_.alive(now_ns);
  if (notifier_.wants_status(now_ns)) {
    notifier_.tell(relay.host() == nullptr
                       ? std::string(relay.obstacle())
                       : fmt::format("frame {}, {} clients", relay.host()->frame(),
                                     relay.host()->participants() + relay.host()->observers()));
  }
  if (nats != nullptr) {
    reports_.clear();
    nats->take(reports_);
    for (const transport::ClientStatusMessage& report : reports_) relay.upstream().report(report);
  }
  if (!options_.metrics || now_ns < next_figures_ns_) return;
  next_figures_ns_ = now_ns + kSecond / 4;
  const client::ClientCore& core = relay.upstream().first().client().core();
  FiguresNow figures;
  figures.publishes = relay.host() != nullptr;
  figures.opened = relay.opened();
  figures.client = {.status = core.status(), .lag_s = core.statistics().smoothed_latency_ns / 1e9};
  if (relay.host() != nullptr) {
    const host::HostTotals totals = relay.host()->totals();
    figures.frames = totals.frames;
    figures.snapshots = totals.snapshots;
    figures.inputs_refused = totals.refused_inputs;
    figures.clients = relay.host()->participants() + relay.host()->observers();
  }
  if (nats != nullptr) {
    figures.published = nats->counts();
    figures.followers = nats->followers();
  }
  relay.upstream().each_feed([&figures](Feed& feed) {
    figures.joins += feed.joins();
    if (const auto* const in = dynamic_cast<const transport::NatsClientPort*>(&feed.port())) {
      if (!figures.followed) figures.followed.emplace();
      figures.followed->asked += in->counts().asked;
      figures.followed->repaired += in->counts().repaired;
      figures.followed->given_up += in->counts().given_up;
      figures.followed->malformed += in->dropped();
    }
  });
  client_watch_.saw(figures.client.status, now_ns);
  latest_.offer(figures);
}

int Service::run() {
  std::unique_ptr<metrics::Endpoint> endpoint;
  if (options_.metrics) {
    auto made = metrics::Endpoint::create(*options_.metrics, health_, [this](metrics::Page& page) {
      describe(page, options_.session, latest_.get());
    });
    if (!made) {
      spdlog::error(made.error().message);
      return 1;
    }
    endpoint = std::move(*made);
    spdlog::info(endpoint->notice());
  }
  auto upstream = Upstream::create({.session = options_.session,
                                    .log = log_line,
                                    .measure_ns = steady_ns,
                                    .new_id = client::random_client_id},
                                   [this](transport::ClientId id) { return follow(id); });
  if (!upstream) {
    spdlog::error(upstream.error().message);
    return upstream.error().code == ErrorCode::kTransport ? 1 : 2;
  }
  const auto side = [this](const Side& of) {
    return of.is_dds() ? fmt::format("DDS domain {}", options_.domain) : transport::without_password(of.url);
  };
  spdlog::info("session '{}' from {} to {}, as site {}", options_.session, side(options_.from),
               side(options_.to), options_.site);
  if (!options_.profile.empty())
    spdlog::info("{}", transport::describe_dds_profile(
                           options_.domain, options_.profile,
                           options_.to.is_dds() ? transport::Side::kServer : transport::Side::kClient));
  {
    Relay relay(
        {.client_limit = options_.client_limit, .log = log_line, .clock_ns = steady_ns}, **upstream,
        [this](const transport::SessionMessage& session) { return publish(session); }, *this);
    constexpr std::int64_t kLongestNs = 50 * kMillisecond;
    while (!signals_.stop()) {
      const std::int64_t due_ns = relay.poll(client::now());
      watch(relay);
      const std::int64_t wait_ns = std::min(kLongestNs, due_ns - steady_ns());
      if (wait_ns > 0) bell_.wait(std::chrono::nanoseconds(wait_ns));
    }
  }
  return 0;
}

}  // namespace

int run(const Options& options, SignalWatch& signals) {
  Service service(options, signals);
  return signals.finish(service.run());
}

}  // namespace tandem::relay
