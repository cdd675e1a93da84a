#pragma once
// When an engine that ended is started again.

#include <cstdint>
#include <optional>

namespace tandem::daemon {

/// After each end the next start waits twice as long, from half a second to half a minute. An engine that
/// ended ten times, each time within a minute of its start, is given up. Not thread-safe.
class Restarts {
 public:
  static constexpr std::int64_t kFirstWaitNs = 500'000'000, kLongestWaitNs = 30'000'000'000;
  static constexpr std::int64_t kGoodNs = 60'000'000'000;
  static constexpr int kMaxInARow = 10;

  /// A session ended that ran for so long. Returns the time to wait; empty: no further start.
  [[nodiscard]] std::optional<std::int64_t> wait_after_ns(std::int64_t ran_ns);

 private:
  int in_a_row_ = 0;
};

}  // namespace tandem::daemon
