#pragma once
// Quantiles of durations in bounded memory.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tandem {

/// A log-linear histogram (as HdrHistogram): 64 buckets per power of two of nanoseconds, so a quantile is off
/// by 0.8 % at most, from 0 to ten hours; longer durations count as ten hours. 10 KB, allocates nothing. Not
/// thread-safe.
class DurationHistogram {
 public:
  /// Negative durations (two clocks that disagree) count as zero.
  void add(std::int64_t duration_ns) {
    ++counts_[bucket_of(static_cast<std::uint64_t>(duration_ns < 0 ? 0 : duration_ns))];
    ++total_;
  }

  /// Milliseconds; `share` in [0, 1], 0.5 is the median; 0 while empty.
  [[nodiscard]] double quantile_ms(double share) const {
    if (total_ == 0) return 0;
    const double rank = share * static_cast<double>(total_ - 1);
    std::uint64_t below = 0;
    for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
      below += counts_[bucket];
      if (static_cast<double>(below) > rank) return middle_ns(bucket) * 1e-6;
    }
    return middle_ns(kBuckets - 1) * 1e-6;
  }
  [[nodiscard]] std::uint64_t count() const { return total_; }
  void clear() { *this = {}; }

 private:
  static constexpr std::size_t kStepBits = 6;
  static constexpr std::size_t kSteps = 1U << kStepBits;
  static constexpr std::size_t kBuckets = kSteps * 40;  // up to 2^45 ns

  // The leading bit's place chooses the octave and the kStepBits below it the bucket within; below kSteps
  // every nanosecond has a bucket of its own.
  static std::size_t bucket_of(std::uint64_t ns) {
    if (ns < kSteps) return static_cast<std::size_t>(ns);
    const auto shift = static_cast<std::size_t>(std::bit_width(ns)) - kStepBits - 1;
    const std::size_t bucket = ((shift + 1) << kStepBits) + static_cast<std::size_t>((ns >> shift) - kSteps);
    return bucket < kBuckets ? bucket : kBuckets - 1;
  }
  static double middle_ns(std::size_t bucket) {
    if (bucket < kSteps) return static_cast<double>(bucket);
    const std::size_t shift = (bucket >> kStepBits) - 1;
    return (static_cast<double>(kSteps + bucket % kSteps) + 0.5) *
           static_cast<double>(std::uint64_t{1} << shift);
  }

  std::array<std::uint32_t, kBuckets> counts_{};
  std::uint64_t total_ = 0;
};

}  // namespace tandem
