#pragma once
// How much of a snapshot may be on its way at once.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "sdk/transport/units.hpp"

namespace tandem::host {

/// Bytes in flight that fill a link of unknown rate without filling the queues in front of it, where deltas
/// wait too: grows while parts arrive as fast as the first ones did, shrinks when they wait. Delay-based, as
/// in LEDBAT (RFC 6817), because DDS repairs what is lost before anybody here can see it. Not thread-safe.
class TransferWindow {
 public:
  static constexpr std::size_t kLeast = 5'200;     ///< also what goes out before anything is known
  static constexpr std::size_t kMost = 2U << 20U;  ///< 1 Gbit/s at 16 ms from sending to acknowledgement
  static constexpr std::int64_t kTargetNs = 100 * kMillisecond;  ///< of waiting in queues

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// So much arrived everywhere, `delay_ns` after it was sent for the first and only time.
  void arrived(std::size_t size, std::int64_t delay_ns, std::int64_t now_ns) {
    delay_ns_ = delay_ns_ ? *delay_ns_ + (delay_ns - *delay_ns_) / 4 : delay_ns;
    least_delay_ns_ = std::min(least_delay_ns_, delay_ns);
    if (delay_ns - least_delay_ns_ > kTargetNs) {
      cut(now_ns);
    } else {
      const bool searching = bytes_ < threshold_;  // half as much again every round trip
      bytes_ = std::min(kMost, bytes_ + (searching ? size / 2 : size * size / bytes_ + 1));
    }
  }
  /// Something did not arrive within patience_ns().
  void lost(std::int64_t now_ns) { cut(now_ns); }
  /// How long a part may take until it is sent again.
  [[nodiscard]] std::int64_t patience_ns() const {
    return delay_ns_ ? std::max(kSecond, 4 * *delay_ns_) : 2 * kSecond;
  }

 private:
  // Once a round trip, as what was sent before tells nothing new.
  void cut(std::int64_t now_ns) {
    if (cut_at_ns_ && now_ns - *cut_at_ns_ < delay_ns_.value_or(kSecond)) return;
    cut_at_ns_ = now_ns;
    bytes_ = std::max(kLeast, bytes_ - bytes_ / 3);
    threshold_ = bytes_;
  }

  std::size_t bytes_ = kLeast;
  std::size_t threshold_ = SIZE_MAX;  // below it the window grows fast
  std::int64_t least_delay_ns_ = INT64_MAX;
  std::optional<std::int64_t> delay_ns_;  // smoothed
  std::optional<std::int64_t> cut_at_ns_;
};

}  // namespace tandem::host
