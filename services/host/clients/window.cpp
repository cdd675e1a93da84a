#include "services/host/clients/window.hpp"

#include <algorithm>

namespace tandem::host {

void RoundTrip::expect(std::int64_t duration_ns) {
  if (known_) return;
  known_ = true;
  smoothed_ = duration_ns;
  deviation_ = duration_ns / 4;
}

void RoundTrip::measured(std::int64_t duration_ns) {
  if (!known_) {
    known_ = true;
    smoothed_ = duration_ns;
    deviation_ = duration_ns / 2;
    return;
  }
  const std::int64_t error = duration_ns - smoothed_;
  smoothed_ += error / 8;
  deviation_ += ((error < 0 ? -error : error) - deviation_) / 4;
}

std::uint32_t window_for(std::int64_t round_trip_ns, std::int64_t period_ns, std::uint32_t ceiling) {
  const std::int64_t period = std::max<std::int64_t>(period_ns, 1);
  const std::int64_t frames = (round_trip_ns + period - 1) / period + 1;
  const std::int64_t top = std::max(ceiling, kSmallestWindow);
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(frames, kSmallestWindow, top));
}

}  // namespace tandem::host
