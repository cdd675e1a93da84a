#include "services/relay/service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <memory>
#include <utility>

#include "sdk/client/api/clock.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/workers/doorbell.hpp"
#include "services/follow/following/kept_state.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/program/logging/log.hpp"
#include "services/relay/relay.hpp"
#include "services/relay/sides.hpp"
#include "services/relay/watched.hpp"

namespace tandem::relay {
namespace {

using transport::steady_ns;

class Service final : private Relay::Publishing {
 public:
  Service(const RelayOptions& options, SignalWatch& signals)
      : options_(options), signals_(signals), sides_(options, signals.stop(), bell_) {}

  int run();

 private:
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
  void keep_state(Relay& relay);

  const RelayOptions& options_;
  SignalWatch& signals_;
  const std::shared_ptr<transport::Doorbell> bell_ = std::make_shared<transport::Doorbell>();
  Sides sides_;
  std::optional<following::KeptState> kept_;
  std::int64_t keep_ns_ = 0;
  std::optional<host::Publisher> publisher_;
  std::vector<transport::ClientStatusMessage> reports_;
  std::uint64_t connections_lost_ = 0;
  std::string trouble_;  // with NATS, as it was told last
  metrics::ClientWatch client_watch_;
  Watched watched_;
};

// Hands over figures a few times a second, because a scrape must not wait for the work.
void Service::watch(Relay& relay) {
  const std::int64_t now_ns = steady_ns();
  transport::ServerPort* const port = relay.port();
  // The port that follows tells its client of its troubles, which logs them.
  std::string trouble = port == nullptr ? std::string() : port->trouble();
  if (trouble != trouble_ && !trouble.empty()) spdlog::warn("{}", trouble);
  trouble_ = std::move(trouble);
  const std::uint64_t lost =
      (port == nullptr ? 0 : port->connections_lost()) + relay.upstream().first().port().connections_lost();
  if (lost > connections_lost_)
    spdlog::warn("a connection to NATS was lost, and is made anew; what was missed meanwhile is asked for");
  connections_lost_ = lost;
  watched_.turned(now_ns,
                  !trouble_.empty() ? "the NATS server cannot be reached, or does not permit it"
                  : transport::dds_server_network() != transport::NetworkState::kThere
                      ? "the network address that DDS is bound to is gone"
                      : relay.obstacle(),
                  [&relay] {
                    if (relay.stands_by()) return std::string("it stands by for another relay");
                    return relay.host() == nullptr
                               ? std::string(relay.obstacle())
                               : fmt::format("frame {}, {} clients", relay.host()->frame(),
                                             relay.host()->participants() + relay.host()->observers());
                  });
  if (port != nullptr) {
    reports_.clear();
    port->take(reports_);
    for (const transport::ClientStatusMessage& report : reports_) relay.upstream().report(report);
  }
  const client::ClientCore& core = relay.upstream().first().client().core();
  watched_.saw_frames(core.statistics().frames_applied, core.frames_are_due(now_ns), now_ns);
  if (!watched_.wants_figures(now_ns)) return;
  FiguresNow figures;
  figures.stands_by = relay.stands_by();
  figures.publishes = relay.host() != nullptr && !figures.stands_by;
  figures.opened = relay.opened();
  figures.connections_lost = connections_lost_;
  figures.client = {.status = core.status(), .lag_s = core.statistics().smoothed_latency_ns / 1e9};
  if (relay.host() != nullptr) {
    const host::HostTotals totals = relay.host()->totals();
    figures.frames = totals.frames;
    figures.snapshots = totals.snapshots;
    figures.inputs_refused = totals.refused_inputs;
    figures.clients = relay.host()->participants() + relay.host()->observers();
  }
  if (port != nullptr) figures.published = port->counts();
  relay.upstream().each_feed([&figures](Feed& feed) {
    figures.joins += feed.joins();
    figures.follows(feed.port());
  });
  client_watch_.saw(figures.client.status, now_ns);
  watched_.offer(figures);
}

void Service::keep_state(Relay& relay) {
  const std::int64_t now_ns = steady_ns();
  if (!kept_ || now_ns < keep_ns_ || relay.host() == nullptr || relay.stands_by()) return;
  keep_ns_ = now_ns + following::KeptState::kIntervalNs;
  following::KeptState::States states;
  relay.upstream().each_feed([&](Feed& feed) {
    if (!feed.holds_state() || feed.epoch() == 0) return;
    if (auto cut = feed.client().cut())
      states.push_back(following::KeptState::state(std::move(*cut), feed.epoch()));
  });
  if (states.empty()) return;
  if (const auto written = kept_->write(states); !written) {
    spdlog::warn("{}: after a restart all clients will join anew", written.error().message);
    kept_.reset();
  }
}

int Service::run() {
  if (const auto good = sides_.check(); !good) {
    spdlog::error(good.error().message);
    return 2;
  }
  if (const auto served = watched_.serve(options_); !served) {
    spdlog::error(served.error().message);
    return 1;
  }
  std::vector<std::uint32_t> streams;
  if (!options_.state.empty()) {
    kept_.emplace(options_.state);
    keep_ns_ = steady_ns() + following::KeptState::kFirstNs;
    auto snapshots = kept_->read();
    for (const transport::SnapshotMessage& snapshot : snapshots) streams.push_back(snapshot.stream.id);
    sides_.set_kept(std::move(snapshots));
  }
  auto upstream = Upstream::create({.session = options_.session,
                                    .log = logging::write,
                                    .measure_ns = steady_ns,
                                    .new_id = transport::random_client_id,
                                    // Whoever follows over NATS checks every hash.
                                    .keeps_state = !options_.from.is_dds() || options_.to.is_dds(),
                                    .streams = std::move(streams)},
                                   [this](transport::ClientId id) { return sides_.follow(id); });
  if (!upstream) {
    spdlog::error(upstream.error().message);
    return upstream.error().code == ErrorCode::kTransport ? 1 : 2;
  }
  sides_.tell();
  {
    Relay relay(
        {.client_limit = options_.client_limit,
         // A connection to NATS costs nothing to make anew; a participant of DDS is heard by all of its
         // domain.
         .retry_ns = options_.to.is_dds() ? Relay::kRetryNs : kSecond,
         .log = logging::write,
         .clock_ns = steady_ns},
        **upstream, [this](const transport::SessionMessage& session) { return sides_.publish(session); },
        *this);
    constexpr std::int64_t kLongestNs = 50 * kMillisecond;
    while (!signals_.stop()) {
      const std::int64_t due_ns = relay.poll(client::now());
      watch(relay);
      keep_state(relay);
      const std::int64_t wait_ns = std::min(kLongestNs, due_ns - steady_ns());
      if (wait_ns > 0) bell_->wait(std::chrono::nanoseconds(wait_ns));
    }
  }
  return 0;
}

}  // namespace

int run(const RelayOptions& options, SignalWatch& signals) {
  if (!options.folder.empty()) return signals.finish(run_audience(options, signals));
  Service service(options, signals);
  return signals.finish(service.run());
}

}  // namespace tandem::relay
