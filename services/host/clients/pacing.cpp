#include "services/host/clients/pacing.hpp"

#include <cmath>

namespace tandem::host {

Pacing::Pacing(double frame_rate_hz, bool free_rate)
    : free_rate_(free_rate), nominal_ns_(std::llround(1e9 / frame_rate_hz)), measured_ns_(nominal_ns_) {}

void Pacing::start(std::int64_t now_ns) {
  last_ns_ = now_ns;
  deadline_ns_ = now_ns;
  suspended_from_ns_ = now_ns;
}

void Pacing::frame_started(std::int64_t now_ns, bool suspended) {
  constexpr std::int64_t kMostBehind = 4;  // periods; sprinting longer than that looks worse than a pause
  if (!suspended) measured_ns_ += (now_ns - last_ns_ - measured_ns_) / 8;
  last_ns_ = now_ns;
  const bool restart = suspended || now_ns - deadline_ns_ > kMostBehind * nominal_ns_;
  if (free_rate_) {
    deadline_ns_ = now_ns;
    suspended_from_ns_ = now_ns + nominal_ns_;
    return;
  }
  deadline_ns_ = (restart ? now_ns : deadline_ns_) + nominal_ns_;
  suspended_from_ns_ = deadline_ns_;
}

}  // namespace tandem::host
