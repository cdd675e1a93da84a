#include "services/host/durations.hpp"

#include <algorithm>

namespace tandem::host {

void Durations::add(double ms) {
  const auto bin = static_cast<std::size_t>(std::clamp(ms / kBinMs, 0.0, double{kBins - 1}));
  ++bins_[bin];
  used_ = std::max(used_, bin + 1);
  ++count_;
}

double Durations::percentile_ms(double share) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<double>(count_) * share;
  double seen = 0;
  for (std::size_t i = 0; i < used_; ++i) {
    seen += bins_[i];
    if (seen >= wanted && bins_[i] > 0) return static_cast<double>(i + 1) * kBinMs;
  }
  return static_cast<double>(kBins) * kBinMs;
}

void Durations::clear() {
  std::fill_n(bins_.begin(), used_, 0U);
  used_ = 0;
  count_ = 0;
}

}  // namespace tandem::host
