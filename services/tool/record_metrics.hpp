#pragma once
// The metrics and the health of `tandem record`: --metrics.

#include <cstdint>
#include <memory>
#include <string>

#include "services/program/metrics/client_series.hpp"
#include "services/program/metrics/endpoint.hpp"
#include "services/program/metrics/health.hpp"
#include "services/program/metrics/latest.hpp"
#include "services/tool/headless_client.hpp"
#include "tandem/result.hpp"

namespace tandem::tool {

/// Does nothing without an address. The thread of the client calls turned(), which never waits.
class RecordMetrics final : public TurnListener {
 public:
  /// Starts to answer. `file` is what is recorded into, `session` what is followed. Errors: those of
  /// Endpoint::create().
  [[nodiscard]] Result<void> serve(const metrics::Address& address, const std::string& session,
                                   const std::string& file);
  void turned(const client::ClientCore& core, const Kept& kept, std::int64_t now_ns) override;

 private:
  struct FiguresNow {
    Kept kept;
    metrics::ClientNow client;
  };
  void describe(metrics::Page& page) const;

  static constexpr std::int64_t kPeriodNs = kSecond / 4;

  std::string session_, folder_;
  std::int64_t next_ns_ = 0;
  metrics::ClientWatch watch_;
  metrics::Latest<FiguresNow> latest_;
  metrics::Health health_;
  std::unique_ptr<metrics::Endpoint> endpoint_;  // last: ends before what it reads
};

}  // namespace tandem::tool
