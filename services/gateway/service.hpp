#pragma once
// The gateway between its two threads: one for the session, one for the connections.

#include <atomic>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
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
class Service final : public WebServer::Handler {
 public:
  /// `port` and `signals` must outlive it.
  /// `id` is that of the gateway as a client of the session, by which the port is known, too.
  Service(const GatewayOptions& options, Secrets secrets, transport::ClientId id, transport::ClientPort& port,
          SignalWatch& signals);

  /// Follows the session, in a thread of its own.
  void follow(const std::stop_token& stop, WebServer& server);
  /// Errors: those of Endpoint::create().
  [[nodiscard]] Result<void> serve_metrics(const metrics::Address& address, const std::string& session);

  std::variant<ViewerId, Refusal> open(const Request& request) override;
  tl::expected<Pass, Refusal> log_in(const Request& request) override;
  std::optional<Refusal> receive(ViewerId id, std::span<const std::byte> message) override;
  Gateway::Next next(ViewerId id) override;
  void closed(ViewerId id) override;
  void list_ready(std::vector<ViewerId>& out) override;
  void list_not_reading(std::vector<ViewerId>& out) override;
  void list_silent(std::vector<ViewerId>& out) override;
  void list_over(std::vector<std::pair<ViewerId, Refusal>>& out) override;
  void refused(Refusal refusal) override;
  void turned_away(TurnedAway why) override;
  bool tick() override;
  void reloaded(const Result<std::string>& certificate) override;
  Health health() override;

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
