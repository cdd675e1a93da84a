#pragma once
// Stretches of time by a clock that the caller owns; nothing where there is none.

#include <cstdint>

namespace tandem {

class Stopwatch {
 public:
  using Clock = std::int64_t (*)();  ///< monotonic, nanoseconds; may be null
  explicit Stopwatch(Clock clock) : clock_(clock), last_ns_(clock != nullptr ? clock() : 0) {}
  /// Milliseconds since construction or the last lap; 0 without a clock.
  double lap_ms() {
    if (clock_ == nullptr) return 0;
    const std::int64_t now_ns = clock_();
    const double ms = static_cast<double>(now_ns - last_ns_) * 1e-6;
    last_ns_ = now_ns;
    return ms;
  }

 private:
  Clock clock_;
  std::int64_t last_ns_;
};

}  // namespace tandem
