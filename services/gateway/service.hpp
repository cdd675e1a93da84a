#pragma once
// The gateway between its two threads: one for the session, one for the connections.

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sdk/wire/port.hpp"
#include "services/follow/following/kept_state.hpp"
#include "services/follow/following/session_client.hpp"
#include "services/gateway/entrance/admission.hpp"
#include "services/gateway/entrance/guest_book.hpp"
#include "services/gateway/gateway.hpp"
#include "services/gateway/metrics.hpp"
#include "services/gateway/options.hpp"
#include "services/gateway/web_server.hpp"
#include "services/program/metrics/address.hpp"
#include "services/program/metrics/endpoint.hpp"
#include "services/program/metrics/health.hpp"
#include "services/program/metrics/latest.hpp"
#include "services/program/process/service_notifier.hpp"
#include "services/program/process/signal_watch.hpp"

namespace tandem::gateway {

/// The port waits without the lock, so that no viewer waits for the network.
class Service {
 public:
  /// `port` and `signals` must outlive it.
  /// `id` is that of the gateway as a client of the session, by which the port is known, too.
  Service(const GatewayOptions& options, Secrets secrets, transport::ClientId id, transport::ClientPort& port,
          SignalWatch& signals);

  /// Follows the session, in a thread of its own.
  void follow(const std::stop_token& stop, WebServer& server);
  /// Errors: those of Endpoint::create().
  [[nodiscard]] Result<void> serve_metrics(const metrics::Address& address, const std::string& session);

  // Called by WebServer::run(), in its thread.
  struct Request {
    std::string origin, host, token;                ///< empty if missing
    std::string address;                            ///< of the client, for the log
    std::shared_ptr<accounts::TokenBucket> inputs;  ///< of the viewers of its address
  };
  [[nodiscard]] std::variant<ViewerId, Refusal> open(const Request& request);
  /// Returns what the request's token allows now, without admitting a viewer. A refusal is counted and
  /// logged.
  [[nodiscard]] tl::expected<Pass, Refusal> log_in(const Request& request);
  [[nodiscard]] std::optional<Refusal> receive(ViewerId id, std::span<const std::byte> message);
  [[nodiscard]] Gateway::Next next(ViewerId id);
  void closed(ViewerId id);
  void list_ready(std::vector<ViewerId>& out);
  void list_not_reading(std::vector<ViewerId>& out);
  void list_silent(std::vector<ViewerId>& out);
  /// See Gateway::list_over_cap().
  void list_over_cap(std::vector<std::pair<ViewerId, std::string>>& out);
  /// Viewers whose pass counts no more.
  void list_over(std::vector<std::pair<ViewerId, Refusal>>& out);
  /// Counts a refusal that the server itself decided.
  void refused(Refusal refusal);
  void turned_away(TurnedAway why);
  /// Ten times a second. True if the certificate has to be read again; reloaded() then follows.
  [[nodiscard]] bool tick();
  /// `certificate`: when the new one ends; empty without TLS. An error: the old one is used further.
  void reloaded(const Result<std::string>& certificate);
  /// A JSON object for /healthz, and whether it is answered by 200 or by 503.
  struct Health {
    std::string json;
    bool good = true;
  };
  [[nodiscard]] Health health();

 private:
  void watch();
  void keep_state();
  void reload();
  void write_down(const GuestBook::Line& line) const;
  void write_deeds(ViewerId id, std::int64_t now_ns);
  tl::expected<Pass, Refusal> look_at(std::string_view token) const;
  Refusal refuse(const Request& request, Refusal why);

  const GatewayOptions options_;
  transport::ClientPort& port_;
  SignalWatch& signals_;
  // Of the connections' thread alone.
  Admission admission_;
  GuestBook guests_;
  std::int64_t next_deeds_ns_ = 0;

  // Of the session's thread alone.
  std::optional<following::KeptState> kept_;
  std::int64_t keep_ns_ = 0;

  std::mutex mutex_;  // guards all below; port_.wait() and wake() need no guard
  following::SessionClient client_;
  Gateway gateway_;
  CountLog log_;
  ServiceNotifier notifier_;
  Epoch epoch_ = 0;                  // that the log names
  std::int64_t quiet_until_ns_ = 0;  // about descriptors
  std::int64_t next_figures_ns_ = 0;
  metrics::ClientWatch client_watch_;
  // Not guarded by the lock.
  metrics::Latest<FiguresNow> latest_;
  metrics::Health health_;
  std::unique_ptr<metrics::Endpoint> endpoint_;  // last: ends before what it reads
};

}  // namespace tandem::gateway
