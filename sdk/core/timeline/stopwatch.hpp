#pragma once
// Stretches of time by a clock that the caller owns; nothing where there is none.

#include <cstdint>
#include <utility>

namespace tandem {

class Stopwatch {
 public:
  using Clock = std::int64_t (*)();  ///< monotonic, nanoseconds; may be null
  explicit Stopwatch(Clock clock) : clock_(clock), last_ns_(clock != nullptr ? clock() : 0) {}
  /// Since construction or the last lap; 0 without a clock.
  std::int64_t lap_ns() {
    if (clock_ == nullptr) return 0;
    const std::int64_t now_ns = clock_();
    return now_ns - std::exchange(last_ns_, now_ns);
  }

 private:
  Clock clock_;
  std::int64_t last_ns_;
};

}  // namespace tandem
