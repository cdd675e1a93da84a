#pragma once
// How much of a snapshot may be on its way at once.

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "sdk/transport/units.hpp"

namespace tandem::accounts {

/// Bytes in flight that fill a link of unknown rate without filling the queues in front of it, where deltas
/// wait too. Follows the delay, as FAST TCP does (Jin, Wei, Low 2004), because a queue that drops parts has
/// long made deltas late: where a link is full, the delay settles at kQueueNs above the least. Not
/// thread-safe.
class TransferWindow {
 public:
  static constexpr std::size_t kLeast = 1'300;
  static constexpr std::size_t kFirst = 2'600;     ///< goes out before anything is known
  static constexpr std::size_t kMost = 4U << 20U;  ///< 1 Gbit/s at 30 ms from sending to acknowledgement
  static constexpr std::int64_t kQueueNs = 100 * kMillisecond;

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// Something arrived everywhere, `delay_ns` after it was sent for the first and only time.
  void arrived(std::int64_t delay_ns, std::int64_t now_ns) {
    sum_ns_ += delay_ns;
    ++arrivals_;
    delay_ns_ = sum_ns_ / arrivals_;
    if (now_ns - round_ns_ < delay_ns_) return;  // once a round trip
    least_ns_ = std::min(least_ns_, delay_ns_);
    const double wanted = static_cast<double>(least_ns_ + kQueueNs) / static_cast<double>(delay_ns_ + 1);
    // A queue may drop before it delays: who lost something in a round does not grow in it.
    resize(std::min(wanted, lost_ ? kAfterLoss : 2.0), now_ns);
  }
  /// Something did not arrive within patience_ns(), or was overtaken.
  void lost(std::int64_t now_ns) {
    lost_ = true;
    if (now_ns - round_ns_ >= kSecond) resize(0.5, now_ns);
  }
  /// How long a part may take until it is sent again.
  [[nodiscard]] std::int64_t patience_ns() const {
    return delay_ns_ > 0 ? std::max(kSecond / 2, 4 * delay_ns_) : 2 * kSecond;
  }

 private:
  static constexpr double kAfterLoss = 0.7;

  void resize(double factor, std::int64_t now_ns) {
    const auto wanted = static_cast<std::size_t>(static_cast<double>(bytes_) * std::max(factor, 0.5));
    // A little on top, so that delays that have other reasons do not hold it there.
    bytes_ = std::clamp(wanted + kLeast / 2, kLeast, kMost);
    round_ns_ = now_ns;
    sum_ns_ = arrivals_ = 0;
    lost_ = false;
  }

  std::size_t bytes_ = kFirst;
  std::int64_t least_ns_ = INT64_MAX;       // mean of a round
  std::int64_t delay_ns_ = 0;               // mean of this round so far, or of the last; 0: none yet
  std::int64_t round_ns_ = 0;               // when this round began
  std::int64_t sum_ns_ = 0, arrivals_ = 0;  // of this round
  bool lost_ = false;                       // in this round
};

}  // namespace tandem::accounts
