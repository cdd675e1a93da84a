#pragma once
// The figures that a client publishes once a second for monitors of the session.

#include <cstdint>

#include "sdk/client/session/statistics.hpp"
#include "sdk/wire/messages.hpp"

namespace tandem::client {

/// Decides when the next report is due, and computes the bandwidth since the last one. Not thread-safe.
class StatusReport {
 public:
  explicit StatusReport(std::int64_t period_ns) : period_ns_(period_ns) {}

  [[nodiscard]] std::int64_t due_ns() const { return last_ns_ + period_ns_; }
  /// The figures only: the caller fills in the client, the session and the epoch.
  [[nodiscard]] transport::ClientStatusMessage next(const Statistics& statistics, std::int64_t now_ns);

 private:
  std::int64_t period_ns_;
  std::int64_t last_ns_ = 0;
  std::uint64_t last_bytes_ = 0, last_wire_ = 0;
};

}  // namespace tandem::client
