#pragma once
// What a relay shows of itself: metrics, health, the service's status.

#include <spdlog/spdlog.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "services/program/metrics/endpoint.hpp"
#include "services/program/metrics/health.hpp"
#include "services/program/metrics/latest.hpp"
#include "services/program/process/service_notifier.hpp"
#include "services/relay/metrics.hpp"
#include "services/relay/options.hpp"

namespace tandem::relay {

/// Figures go from the relay's thread to that of the scrapes a few times a second, because a scrape must not
/// wait for the work.
class Watched {
 public:
  /// Serves --metrics, if the options say so. Errors: those of metrics::Endpoint.
  [[nodiscard]] Result<void> serve(const RelayOptions& options) {
    if (!options.metrics) return {};
    auto endpoint = metrics::Endpoint::create(
        *options.metrics, health_,
        [this, session = options.session](metrics::Page& page) { describe(page, session, latest_.get()); });
    if (!endpoint) return tl::unexpected(endpoint.error());
    endpoint_ = std::move(*endpoint);
    spdlog::info(endpoint_->notice());
    return {};
  }
  /// Call it in each turn. `obstacle`: as in Health::beat(). `status` makes a line for people when one is
  /// due.
  template <class Status>
  void turned(std::int64_t now_ns, const char* obstacle, const Status& status) {
    health_.beat(now_ns, obstacle);
    notifier_.alive(now_ns);
    if (notifier_.wants_status(now_ns)) notifier_.tell(status());
  }
  /// As Health::saw_frames().
  void saw_frames(std::uint64_t frames, bool due, std::int64_t now_ns) {
    health_.saw_frames(frames, due, now_ns);
  }
  /// True when offer() is due.
  [[nodiscard]] bool wants_figures(std::int64_t now_ns) {
    if (!endpoint_ || now_ns < next_ns_) return false;
    next_ns_ = now_ns + kSecond / 4;
    return true;
  }
  void offer(const FiguresNow& figures) { latest_.offer(figures); }

 private:
  metrics::Health health_;
  metrics::Latest<FiguresNow> latest_;
  std::unique_ptr<metrics::Endpoint> endpoint_;  // ends before what it reads
  std::int64_t next_ns_ = 0;
  ServiceNotifier notifier_;
};

}  // namespace tandem::relay
