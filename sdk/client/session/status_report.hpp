#pragma once
// The figures that a client sends to whoever watches the session, once a second.

#include <cstdint>

#include "sdk/client/session/statistics.hpp"
#include "sdk/transport/messages.hpp"

namespace tandem::client {

/// Knows when the next report is due, and the bandwidth since the last one. Not thread-safe.
class StatusReport {
 public:
  explicit StatusReport(std::int64_t period_ns) : period_ns_(period_ns) {}

  [[nodiscard]] std::int64_t due_ns() const { return last_ns_ + period_ns_; }
  /// The figures alone: who reports, and of which session and epoch, is the caller's to fill in.
  [[nodiscard]] transport::ClientStatusMessage next(const Statistics& statistics, std::int64_t now_ns);

 private:
  std::int64_t period_ns_;
  std::int64_t last_ns_ = 0;
  std::uint64_t last_bytes_ = 0;
};

}  // namespace tandem::client
