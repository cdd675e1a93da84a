#pragma once
// Distinguishes a client that stays behind from one that catches up.

#include <cstddef>
#include <cstdint>

#include "sdk/wire/units.hpp"

namespace tandem::client {

/// After a lost link a client has many deltas to apply and soon catches up. A client that is too slow for the
/// session never does, and its world gets older and older; a snapshot brings it back. Not thread-safe.
class LagLimit {
 public:
  /// Seconds of frames that may wait without a time limit. The value is below the depth of the delta history;
  /// otherwise gaps would come first.
  static constexpr double kWaitingS = 5;
  /// A longer queue must halve within this time.
  static constexpr std::int64_t kPatienceNs = 5 * kSecond;

  explicit LagLimit(double frame_rate_hz) : most_(static_cast<std::size_t>(kWaitingS * frame_rate_hz)) {}

  /// `waiting`: complete deltas not yet applied. Returns true if it is time to rejoin.
  [[nodiscard]] bool exceeded(std::size_t waiting, std::int64_t now_ns) {
    if (waiting <= most_) {
      reset();
      return false;
    }
    if (waiting_then_ == 0 || waiting <= waiting_then_ / 2) {
      since_ns_ = now_ns;
      waiting_then_ = waiting;
    }
    return now_ns - since_ns_ >= kPatienceNs;
  }
  void reset() { waiting_then_ = 0; }

 private:
  std::size_t most_;
  std::size_t waiting_then_ = 0;  // 0: the queue is not too long
  std::int64_t since_ns_ = 0;
};

}  // namespace tandem::client
