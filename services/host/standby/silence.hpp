#pragma once
// Whether a live server that DDS calls alive has stopped working.

#include <algorithm>
#include <array>
#include <cstdint>

#include "sdk/wire/units.hpp"

namespace tandem::standby {

/// Adds up the time without a sign of life. A server that works sends an entry of its journal at least every
/// quarter of a second, or after each frame that takes longer; so one whose frames are slow gets more time.
/// Not thread-safe.
class Silence {
 public:
  /// A server that says nothing for so long hangs. Clients see a pause of this, of the takeover and of their
  /// join.
  static constexpr std::int64_t kLongestNs = 3 * kSecond / 2;
  /// ... or for so many times its longest silence of the last minute, if that is more.
  static constexpr std::int64_t kTimes = 2;
  /// During a handover a live server says nothing for this time more.
  static constexpr std::int64_t kHandoverNs = 3 * kSecond;

  /// Call it often. A pause of this process itself counts as a short wait.
  void pass(std::int64_t now_ns) {
    if (passed_ns_ != 0) lasts_ns_ += std::clamp<std::int64_t>(now_ns - passed_ns_, 0, kStepNs);
    passed_ns_ = now_ns;
    if (now_ns - turned_ns_ < kMemoryNs) return;
    turned_ns_ = now_ns;
    longest_ns_ = {0, longest_ns_[0]};
  }
  /// The server works.
  void broken() {
    longest_ns_[0] = std::max(longest_ns_[0], lasts_ns_);
    lasts_ns_ = 0;
  }
  /// Another server is listened to.
  void begin() { *this = Silence(); }

  [[nodiscard]] std::int64_t lasts_ns() const { return lasts_ns_; }
  /// `handing_over`: the server has said that it made its last frame.
  [[nodiscard]] bool too_long(bool handing_over) const {
    const std::int64_t known_ns = kTimes * std::max(longest_ns_[0], longest_ns_[1]);
    return lasts_ns_ >= std::max(kLongestNs, known_ns) + (handing_over ? kHandoverNs : 0);
  }

 private:
  static constexpr std::int64_t kStepNs = kSecond / 10;
  static constexpr std::int64_t kMemoryNs = 30 * kSecond;

  std::int64_t passed_ns_ = 0, turned_ns_ = 0;
  std::int64_t lasts_ns_ = 0;
  std::array<std::int64_t, 2> longest_ns_{};  // of this half minute and of the one before
};

}  // namespace tandem::standby
