#pragma once
// Percentiles of durations in constant memory.

#include <array>
#include <cstddef>
#include <cstdint>

namespace tandem::host {

/// Counts durations in bins of 10 microseconds up to 200 ms; longer ones fall into the last bin.
class Durations {
 public:
  void add(double ms);
  /// Upper edge of the bin that holds the given share of all durations; 0 without any.
  [[nodiscard]] double percentile_ms(double share) const;
  [[nodiscard]] std::uint64_t count() const { return count_; }
  void clear();

 private:
  static constexpr double kBinMs = 0.01;
  static constexpr std::size_t kBins = 20'000;
  std::array<std::uint32_t, kBins> bins_{};
  std::size_t used_ = 0;  // bins from here on are zero: clear() comes every status, and need not touch them
  std::uint64_t count_ = 0;
};

}  // namespace tandem::host
