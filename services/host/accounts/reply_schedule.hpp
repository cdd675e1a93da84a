#pragma once
// Decides when one client is sent a reply.

#include <cstdint>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::accounts {

/// A reply is due on a change, otherwise at most once a second. Not thread-safe.
class ReplySchedule {
 public:
  /// Minimum time between replies that only echo the clock; twice that for observers.
  static constexpr std::int64_t kEchoNs = kSecond;
  static constexpr std::int64_t kChangeNs = 10 * kMillisecond;  ///< minimum time between two replies

  /// Role, phase or reason changed.
  void on_change() { changed_ = true; }
  void on_outcome() { outcomes_due_ = true; }
  /// An acknowledgement brought a newer clock to echo.
  void on_clock() { clock_moved_ = true; }

  /// Something changed that was not told yet.
  [[nodiscard]] bool changed() const { return changed_; }
  /// True if a reply is to be sent now.
  [[nodiscard]] bool due(transport::Role role, std::int64_t now_ns);
  /// A reply is on its way. A reply that is sent only for outcomes counts against their rate.
  void sent(transport::Role role, std::int64_t now_ns);

 private:
  [[nodiscard]] bool elapsed(std::int64_t now_ns, std::int64_t gap_ns) const {
    return last_ns_ == INT64_MIN || now_ns - last_ns_ >= gap_ns;
  }
  [[nodiscard]] bool for_more_than_outcomes(transport::Role role, std::int64_t now_ns) const {
    const std::int64_t echo_ns = role == transport::Role::kObserver ? 2 * kEchoNs : kEchoNs;
    return changed_ || (clock_moved_ && elapsed(now_ns, echo_ns));
  }

  bool changed_ = true;
  bool outcomes_due_ = false;
  bool clock_moved_ = false;
  TokenBucket outcomes_{5, 4};
  std::int64_t last_ns_ = INT64_MIN;
};

}  // namespace tandem::accounts
