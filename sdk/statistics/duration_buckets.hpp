#pragma once
// Counts of durations that one thread makes and another reads.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace tandem {

/// A histogram with few fixed buckets, as monitors want it. One thread adds and any thread reads, without a
/// lock: a reader may see the last duration in its bucket and not yet in the sum. Allocates nothing.
class DurationBuckets {
 public:
  /// Upper bounds: dense around the frames of a session at 30 or 60 Hz.
  static constexpr std::array<std::int64_t, 16> kBoundsNs{
      100'000,    200'000,    500'000,    1'000'000,  2'000'000,  5'000'000,   10'000'000,  15'000'000,
      20'000'000, 30'000'000, 40'000'000, 50'000'000, 75'000'000, 100'000'000, 300'000'000, 1'000'000'000};

  /// What was counted up to a moment.
  struct Counts {
    std::array<std::uint64_t, kBoundsNs.size() + 1> in{};  ///< by bucket; the last one has no bound
    std::int64_t sum_ns = 0;

    /// Negative durations (of a clock that went back) count as zero.
    void add(std::int64_t duration_ns) {
      if (duration_ns < 0) duration_ns = 0;
      ++in[bucket_of(duration_ns)];
      sum_ns += duration_ns;
    }
    [[nodiscard]] std::uint64_t total() const {
      std::uint64_t total = 0;
      for (const std::uint64_t count : in) total += count;
      return total;
    }
  };

  /// Negative durations count as zero.
  void add(std::int64_t duration_ns) {
    if (duration_ns < 0) duration_ns = 0;
    // One thread writes, so a load and a store do, and cost less than an atomic addition.
    std::atomic<std::uint64_t>& count = in_[bucket_of(duration_ns)];
    count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    sum_ns_.store(sum_ns_.load(std::memory_order_relaxed) + duration_ns, std::memory_order_relaxed);
  }
  [[nodiscard]] Counts counts() const {
    Counts counts;
    for (std::size_t i = 0; i < in_.size(); ++i) counts.in[i] = in_[i].load(std::memory_order_relaxed);
    counts.sum_ns = sum_ns_.load(std::memory_order_relaxed);
    return counts;
  }

 private:
  static std::size_t bucket_of(std::int64_t duration_ns) {
    std::size_t bucket = 0;
    while (bucket < kBoundsNs.size() && duration_ns > kBoundsNs[bucket]) ++bucket;
    return bucket;
  }

  std::array<std::atomic<std::uint64_t>, kBoundsNs.size() + 1> in_{};
  std::atomic<std::int64_t> sum_ns_{0};
};

}  // namespace tandem
