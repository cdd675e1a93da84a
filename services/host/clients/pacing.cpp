#include "services/host/clients/pacing.hpp"

#include <fmt/format.h>

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
  constexpr std::int64_t kMaxBehind = 4;  // periods; a longer sprint looks worse than a pause
  if (!suspended) measured_ns_ += (now_ns - last_ns_ - measured_ns_) / 8;
  last_ns_ = now_ns;
  const bool restart = suspended || now_ns - deadline_ns_ > kMaxBehind * nominal_ns_;
  if (free_rate_) {
    deadline_ns_ = now_ns;
    suspended_from_ns_ = now_ns + nominal_ns_;
    return;
  }
  deadline_ns_ = (restart ? now_ns : deadline_ns_) + nominal_ns_;
  suspended_from_ns_ = deadline_ns_;
}

std::string Overrun::frame_took(std::int64_t step_ns, std::int64_t frame_ns, std::int64_t now_ns) {
  constexpr std::int64_t kSpanNs = 1'000'000'000;
  if (since_ns_ == INT64_MIN) since_ns_ = now_ns;
  step_ns_ += static_cast<double>(step_ns);
  frame_ns_ += static_cast<double>(frame_ns);
  ++frames_;
  if (now_ns - since_ns_ < kSpanNs) return {};
  const double period_ms = 1e3 / rate_hz_, step_ms = 1e-6 * step_ns_ / frames_;
  const double frame_ms = 1e-6 * frame_ns_ / frames_;
  step_ns_ = frame_ns_ = frames_ = 0;
  since_ns_ = now_ns;
  const bool slow = frame_ms > period_ms;
  if (slow ? now_ns - told_ns_ < kTellNs : !told_) return {};
  told_ = slow;
  if (!slow) {
    return fmt::format("the session keeps its rate again: a frame takes {:.3g} of {:.3g} ms", frame_ms,
                       period_ms);
  }
  told_ns_ = now_ns;
  return fmt::format(
      "the session runs at {:.3g} instead of {:.3g} frames/s: a frame takes {:.3g} ms, {:.3g} ms of them in "
      "the simulation, but must take at most {:.3g} ms",
      1e3 / frame_ms, rate_hz_, frame_ms, step_ms, period_ms);
}

}  // namespace tandem::host
