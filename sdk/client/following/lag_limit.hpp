#pragma once
// Tells a client that stays behind from one that catches up.

#include <cstddef>
#include <cstdint>

#include "sdk/transport/units.hpp"

namespace tandem::client {

/// After a lost link a client has many deltas to apply and is soon through with them; one that is too slow
/// for the session never is, and sees a world that gets older and older. A snapshot brings it back. Not
/// thread-safe.
class LagLimit {
 public:
  /// So many seconds of frames may wait for as long as they like. Below the depth of the delta history, or
  /// gaps come first.
  static constexpr double kWaitingS = 5;
  /// What is more has to become half as much within this time.
  static constexpr std::int64_t kPatienceNs = 5 * kSecond;

  explicit LagLimit(double frame_rate_hz) : most_(static_cast<std::size_t>(kWaitingS * frame_rate_hz)) {}

  /// `waiting`: complete deltas not yet applied. Returns true when it is time to join again.
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
  std::size_t waiting_then_ = 0;  // 0: not more than may wait
  std::int64_t since_ns_ = 0;
};

}  // namespace tandem::client
