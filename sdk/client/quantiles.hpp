#pragma once
// Percentiles of durations in bounded memory.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tandem::client {

/// A histogram with 64 buckets per power of two, so a percentile is off by 1.6 % at most. Allocates nothing.
/// Not thread-safe.
class Quantiles {
 public:
  /// Negative durations (two clocks that disagree) count as zero.
  void add(std::int64_t duration_ns) {
    const auto value = static_cast<std::uint64_t>(duration_ns < 0 ? 0 : duration_ns);
    ++counts_[index(value)];
    ++total_;
  }
  /// `share` in [0, 1]; milliseconds; 0 while empty.
  [[nodiscard]] double at_ms(double share) const {
    if (total_ == 0) return 0;
    const double rank = share * static_cast<double>(total_ - 1);
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < kBuckets; ++i) {
      if (counts_[i] == 0) continue;
      if (static_cast<double>(below + counts_[i]) > rank) return middle_ns(i) / 1e6;
      below += counts_[i];
    }
    return middle_ns(kBuckets - 1) / 1e6;
  }
  [[nodiscard]] std::uint64_t count() const { return total_; }

 private:
  static constexpr std::size_t kStepBits = 6;
  static constexpr std::size_t kSteps = 1U << kStepBits;
  static constexpr std::size_t kBuckets = kSteps * 40;  // up to 2^45 ns, ten hours

  static std::size_t index(std::uint64_t value) {
    if (value < kSteps) return static_cast<std::size_t>(value);
    const auto shift = static_cast<std::size_t>(std::bit_width(value)) - kStepBits - 1;
    const std::size_t at = ((shift + 1) << kStepBits) + static_cast<std::size_t>((value >> shift) - kSteps);
    return at < kBuckets ? at : kBuckets - 1;
  }
  static double middle_ns(std::size_t at) {
    if (at < kSteps) return static_cast<double>(at);
    const std::size_t shift = (at >> kStepBits) - 1;
    return (static_cast<double>(kSteps + at % kSteps) + 0.5) * static_cast<double>(std::uint64_t{1} << shift);
  }

  std::array<std::uint32_t, kBuckets> counts_{};
  std::uint64_t total_ = 0;
};

}  // namespace tandem::client
