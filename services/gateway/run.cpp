// There is one thread for the session, one for the connections, and a lock around the data that both use.
#include "services/gateway/run.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include "sdk/client/api/client_id.hpp"
#include "sdk/client/api/clock.hpp"
#include "sdk/transport/clock.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "services/gateway/doors/admission.hpp"
#include "services/gateway/doors/listener.hpp"
#include "services/gateway/metrics.hpp"
#include "services/gateway/session_client.hpp"
#include "services/gateway/site.hpp"
#include "services/gateway/web_server.hpp"
#include "services/json/json.hpp"
#include "services/logging/log.hpp"
#include "services/metrics/endpoint.hpp"
#include "services/metrics/health.hpp"
#include "services/metrics/latest.hpp"
#include "services/process/service_notifier.hpp"

namespace tandem::gateway {
namespace {

using transport::steady_ns;

client::CoreOptions core_options(const Options& options) {
  client::CoreOptions core;
  core.session = options.session;
  core.prefer = options.prefer;
  core.id = client::random_client_id();
  core.log = [](LogLevel level, std::string_view line) {
    constexpr std::array kLevels{spdlog::level::info, spdlog::level::warn, spdlog::level::err};
    spdlog::log(kLevels[static_cast<std::size_t>(level)], line);
  };
  core.measure_ns = steady_ns;
  return core;
}

std::string_view phase_name(ClientPhase phase) {
  constexpr std::array<std::string_view, 4> kNames{"searching", "refused", "joining", "playing"};
  return kNames[static_cast<std::size_t>(phase)];
}

/// The port waits without the lock, so that no viewer waits for the network.
class Service final : public WebServer::Handler {
 public:
  Service(const Options& options, Admission admission, transport::ClientPort& port)
      : admission_(std::move(admission)),
        port_(port),
        client_(core_options(options), port),
        gateway_(options.limits, client_) {}

  /// Follows the session, in a thread of its own.
  void follow(const std::stop_token& stop, WebServer& server) {
    constexpr std::int64_t kLongestNs = 100 * kMillisecond;
    while (!stop.stop_requested()) {
      std::int64_t due_ns = 0;
      bool ready = false;
      {
        const std::lock_guard lock(mutex_);
        due_ns = client_.poll(gateway_, client::now());
        if (const auto& session = gateway_.session(); session && session->epoch != epoch_) {
          epoch_ = session->epoch;
          logging::set_context(session->session, epoch_);
        }
        watch();
        gateway_.list_ready(steady_ns(), ready_);
        ready = !ready_.empty();
      }
      if (ready) server.wake();
      const std::int64_t wait_ns = std::min(kLongestNs, due_ns - steady_ns());
      if (wait_ns > 0) port_.wait(std::chrono::nanoseconds(wait_ns));
    }
  }

  std::variant<ViewerId, Refusal> open(const Request& request) override {
    const std::lock_guard lock(mutex_);
    std::optional<Refusal> refusal;
    if (!admission_.origin_fits(request.origin, request.host)) {
      refusal = Refusal::kOrigin;
    } else if (!admission_.token_fits(request.token)) {
      refusal = Refusal::kToken;
    } else if (const auto id = gateway_.admit(request.inputs)) {
      return *id;
    }
    const Refusal why = refusal.value_or(Refusal::kFull);
    ++gateway_.counts().of(why);
    return why;
  }
  std::optional<Refusal> receive(ViewerId id, std::span<const std::byte> message) override {
    const std::lock_guard lock(mutex_);
    return gateway_.receive(id, message, steady_ns());
  }
  Gateway::Next next(ViewerId id) override {
    const std::lock_guard lock(mutex_);
    return gateway_.next(id, steady_ns());
  }
  void closed(ViewerId id) override {
    const std::lock_guard lock(mutex_);
    gateway_.leave(id);
  }
  void list_ready(std::vector<ViewerId>& out) override {
    const std::lock_guard lock(mutex_);
    gateway_.list_ready(steady_ns(), out);
  }
  void list_not_reading(std::vector<ViewerId>& out) override {
    const std::lock_guard lock(mutex_);
    gateway_.list_not_reading(steady_ns(), out);
    gateway_.counts().of(Refusal::kNotReading) += out.size();
  }
  void list_silent(std::vector<ViewerId>& out) override {
    const std::lock_guard lock(mutex_);
    gateway_.list_silent(steady_ns(), out);
  }
  void refused(Refusal refusal) override {
    const std::lock_guard lock(mutex_);
    ++gateway_.counts().of(refusal);
  }
  void turned_away(TurnedAway why) override {
    const std::lock_guard lock(mutex_);
    ++gateway_.counts().of(why);
    if (why != TurnedAway::kDescriptors) return;
    const std::int64_t now_ns = steady_ns();
    if (now_ns < quiet_until_ns_) return;
    quiet_until_ns_ = now_ns + CountLog::kPeriodNs;
    spdlog::warn(
        "out of file descriptors, so connections are closed: raise the limit (ulimit -n, LimitNOFILE=)");
  }
  void tick() override {
    const std::lock_guard lock(mutex_);
    const std::int64_t now_ns = steady_ns();
    if (const auto line = log_.line(gateway_.counts(), gateway_.viewers(), now_ns)) spdlog::info(*line);
    // With the lock, so that it is silent if either thread hangs.
    notifier_.alive(now_ns);
    if (notifier_.wants_status(now_ns))
      notifier_.tell(fmt::format("{}, frame {}, {} viewers", phase_name(client_.core().phase()),
                                 gateway_.frame(), gateway_.viewers()));
  }
  std::string health() override {
    const std::lock_guard lock(mutex_);
    const Counts& counts = gateway_.counts();
    Json refused = Json::object();
    for (std::size_t i = 0; i < kClosings.size(); ++i) refused[kClosings[i].reason] = counts.refused[i];
    Json turned_away = Json::object();
    for (std::size_t i = 0; i < kTurnedAway.size(); ++i)
      turned_away[std::string(kTurnedAway[i])] = counts.turned_away[i];
    const Json health{{"phase", phase_name(client_.core().phase())},
                      {"server_alive", gateway_.server_alive()},
                      {"epoch", gateway_.session() ? gateway_.session()->epoch : 0},
                      {"frame", gateway_.frame()},
                      {"viewers", gateway_.viewers()},
                      {"joined", counts.joined},
                      {"left", counts.left},
                      {"snapshots", counts.snapshots},
                      {"fell_behind", counts.skips},
                      {"messages", counts.messages},
                      {"bytes", counts.bytes},
                      {"inputs", counts.inputs},
                      {"inputs_sent", counts.inputs_sent},
                      {"inputs_refused", counts.inputs_refused},
                      {"stale", counts.stale},
                      {"refused", refused},
                      {"turned_away", turned_away}};
    return health.dump() + '\n';
  }

  /// Errors: those of Endpoint::create().
  [[nodiscard]] Result<void> serve_metrics(const metrics::Address& address, const std::string& session) {
    auto endpoint = metrics::Endpoint::create(
        address, health_, [this, session](metrics::Page& page) { describe(page, session, latest_.get()); });
    if (!endpoint) return tl::unexpected(endpoint.error());
    endpoint_ = std::move(*endpoint);
    spdlog::info(endpoint_->notice());
    return {};
  }

 private:
  /// Hands over figures a few times a second, because a scrape must not wait for the lock, nor hold it.
  void watch() {
    if (!endpoint_) return;
    const std::int64_t now_ns = steady_ns();
    if (now_ns >= next_figures_ns_) {
      next_figures_ns_ = now_ns + kSecond / 4;
      FiguresNow figures{.counts = gateway_.counts(), .viewers = gateway_.viewers(), .client = {}};
      figures.client = {.status = client_.core().status(),
                        .lag_s = client_.core().statistics().smoothed_latency_ns / 1e9};
      client_watch_.saw(figures.client.status, now_ns);
      latest_.offer(figures);
    }
    health_.beat(now_ns, client_watch_.obstacle());
  }

  const Admission admission_;
  transport::ClientPort& port_;
  std::mutex mutex_;  // guards all below; port_.wait() and wake() need no guard
  SessionClient client_;
  Gateway gateway_;
  CountLog log_;
  ServiceNotifier notifier_;
  Epoch epoch_ = 0;                  // that the log names
  std::int64_t quiet_until_ns_ = 0;  // about descriptors
  std::vector<ViewerId> ready_;      // kept to reuse its memory
  std::int64_t next_figures_ns_ = 0;
  metrics::ClientWatch client_watch_;
  // Not guarded by the lock.
  metrics::Latest<FiguresNow> latest_;
  metrics::Health health_;
  std::unique_ptr<metrics::Endpoint> endpoint_;  // last: ends before what it reads
};

bool is_loopback(const std::string& address) { return address.starts_with("127.") || address == "::1"; }

void warn_of_open_doors(const Options& options) {
  if (is_loopback(options.web.address)) return;
  if (options.token_file.empty()) {
    spdlog::warn("there is no --token-file: every host that can reach {} may watch and send inputs",
                 options.web.address);
  } else if (options.web.tls_cert.empty()) {
    spdlog::warn("there is no --tls-cert: others on the network can read the token on its way to {}",
                 options.web.address);
  }
}

int report_error(const Error& error, int exit_code) {
  spdlog::error(error.message);
  return exit_code;
}

}  // namespace

int run(const Options& options, SignalWatch& signals) {
  std::string token;
  if (!options.token_file.empty()) {
    auto read = read_token(options.token_file);
    if (!read) return report_error(read.error(), 2);
    token = std::move(*read);
  }
  Site site;
  if (!options.viewer.empty()) {
    auto loaded = Site::load(options.viewer);
    if (!loaded) return report_error(loaded.error(), 2);
    site = std::move(*loaded);
  }
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.session = options.session;
  dds.secure = options.secure;
  dds.stop = &signals.stop();
  auto port = transport::make_dds_client_port(dds);
  if (!port) return report_error(port.error(), port.error().code == ErrorCode::kTransport ? 1 : 2);
  if (!options.profile.empty())
    spdlog::info("{}",
                 transport::describe_dds_profile(options.domain, options.profile, transport::Side::kClient));

  Service service(options, Admission(std::move(token), options.origins), **port);
  if (options.metrics) {
    if (const auto served = service.serve_metrics(*options.metrics, options.session); !served)
      return signals.finish(report_error(served.error(), 1));
  }
  WebOptions web = options.web;
  web.connections = connections_that_fit(options.web.connections);
  if (web.connections < options.web.connections)
    spdlog::warn("the limit of file descriptors (ulimit -n, LimitNOFILE=) leaves {} of {} connections",
                 web.connections, options.web.connections);
  auto server = WebServer::create(web, site, service);
  if (!server) return signals.finish(report_error(server.error(), 1));
  const bool v6 = options.web.address.find(':') != std::string::npos;
  warn_of_open_doors(options);
  spdlog::info("session '{}' on domain {}: {}://{}:{}/", options.session, options.domain,
               options.web.tls_cert.empty() ? "http" : "https",
               v6 ? fmt::format("[{}]", options.web.address) : options.web.address, (*server)->port());
  std::jthread follower([&](const std::stop_token& done) { service.follow(done, **server); });
  (*server)->run(signals.stop());
  const int exit_code = signals.finish(0);
  follower.request_stop();
  (*port)->wake();
  follower.join();
  return exit_code;
}

}  // namespace tandem::gateway
