#include "services/host/clients/stall_meter.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

void StallMeter::forget(std::int64_t now_ns) {
  const std::int64_t now = now_ns / kStepNs;
  const std::int64_t past = std::min<std::int64_t>(now - step_, kSteps);
  for (std::int64_t i = 1; i <= past; ++i) {
    std::int64_t& old = steps_[static_cast<std::size_t>(step_ + i) % kSteps];
    total_ -= old;
    old = 0;
  }
  step_ = std::max(step_, now);
}

void StallMeter::charge(std::int64_t now_ns, std::int64_t duration_ns) {
  TANDEM_ASSERT(duration_ns >= 0 && now_ns / kStepNs >= step_);
  forget(now_ns);
  steps_[static_cast<std::size_t>(step_) % kSteps] += duration_ns;
  total_ += duration_ns;
}

std::int64_t StallMeter::total_ns(std::int64_t now_ns) {
  forget(now_ns);
  return total_;
}

}  // namespace tandem::host
