#pragma once
// Whether a count grows as fast as it should.

#include <cstdint>
#include <deque>

#include "sdk/wire/units.hpp"

namespace tandem::metrics {

/// Looks at a count over the last three seconds. Not thread-safe.
class RateWatch {
 public:
  static constexpr std::int64_t kSpanNs = 3 * kSecond;

  /// Call several times a second.
  void saw(std::uint64_t count, std::int64_t now_ns) {
    seen_.push_back({now_ns, count});
    while (seen_.size() > 1 && now_ns - seen_[1].at_ns >= kSpanNs) seen_.pop_front();
  }
  /// Growth per second over the span; 0 before a span of half a second was seen.
  [[nodiscard]] double per_second() const {
    if (seen_.size() < 2) return 0;
    const std::int64_t span_ns = seen_.back().at_ns - seen_.front().at_ns;
    if (span_ns < kSecond / 2) return 0;
    return static_cast<double>(seen_.back().count - seen_.front().count) * 1e9 / static_cast<double>(span_ns);
  }
  void forget() { seen_.clear(); }

 private:
  struct Seen {
    std::int64_t at_ns = 0;
    std::uint64_t count = 0;
  };
  std::deque<Seen> seen_;
};

}  // namespace tandem::metrics
