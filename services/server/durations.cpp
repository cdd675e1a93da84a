#include "services/server/durations.hpp"

#include <algorithm>

namespace tandem::server {

void Durations::add(double ms) {
  const double bin = std::clamp(ms / kBinMs, 0.0, double{kBins - 1});
  ++bins_[static_cast<std::size_t>(bin)];
  ++count_;
}

double Durations::percentile_ms(double share) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<double>(count_) * share;
  double seen = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    seen += bins_[i];
    if (seen >= wanted && bins_[i] > 0) return static_cast<double>(i + 1) * kBinMs;
  }
  return static_cast<double>(kBins) * kBinMs;
}

void Durations::clear() {
  bins_.fill(0);
  count_ = 0;
}

}  // namespace tandem::server
