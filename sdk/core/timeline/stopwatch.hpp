#pragma once
// Measures durations with a clock that the caller owns. Without a clock they are 0.

#include <cstdint>
#include <utility>

namespace tandem {

class Stopwatch {
 public:
  using Clock = std::int64_t (*)();  ///< monotonic, nanoseconds; may be null
  explicit Stopwatch(Clock clock) : clock_(clock), last_ns_(clock != nullptr ? clock() : 0) {}
  /// The time since construction or the last lap; 0 without a clock.
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
