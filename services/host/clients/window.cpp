#include "services/host/clients/window.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

void PublishTimes::published(Frame frame, std::int64_t now_ns) {
  TANDEM_ASSERT(frame != 0);  // a zero entry matches nothing
  entries_[frame % kFrames] = {frame, now_ns};
}

std::optional<std::int64_t> PublishTimes::of(Frame frame) const {
  const Entry& entry = entries_[frame % kFrames];
  if (frame == 0 || entry.frame != frame) return std::nullopt;
  return entry.at_ns;
}

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
