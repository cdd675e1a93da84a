#include "services/server/quality.hpp"

#include <algorithm>
#include <cmath>

#include "services/server/mbit.hpp"

namespace tandem::server {
namespace {

// Bits fall with about the threshold's inverse; the square root keeps a decision from overshooting what it
// caused.
constexpr double kExponent = 0.5;
constexpr double kLargestFactor = 1.25;  // of the threshold in one decision
constexpr double kDeadBand = 0.03;       // around the target, so that a calm scene is left alone
// A range grows at once and shrinks slowly: too small a range costs error, too large a one only bits.
constexpr double kShrink = 0.97;

std::int32_t follow(std::int32_t step, std::int32_t wanted) {
  return std::max(wanted, static_cast<std::int32_t>(std::ceil(step * kShrink)));
}

}  // namespace

bool valid_goal(const QualityGoal& goal, const CodecParameters& parameters) {
  return std::isfinite(goal.target_mbit_per_s) && goal.target_mbit_per_s >= 0 &&
         goal.smallest_threshold >= 1 && goal.smallest_threshold <= parameters.threshold &&
         parameters.threshold <= goal.largest_threshold && goal.largest_threshold <= kPositionLimit;
}

QualityControl::QualityControl(const QualityGoal& goal, double frame_rate_hz)
    : goal_(goal),
      frame_rate_hz_(frame_rate_hz),
      frames_per_decision_(
          static_cast<std::uint32_t>(std::clamp(std::lround(frame_rate_hz / 4), 1L, 1000L))) {}

std::int32_t QualityControl::next_threshold(std::int32_t threshold) const {
  if (goal_.target_mbit_per_s == 0) return threshold;
  const double mbit_per_s = static_cast<double>(bytes_) * 8 / kBitsPerMbit * frame_rate_hz_ / frames_;
  const double ratio = mbit_per_s / goal_.target_mbit_per_s;
  if (std::abs(ratio - 1) <= kDeadBand) return threshold;
  const double factor =
      std::clamp(std::pow(std::max(ratio, 1e-3), kExponent), 1 / kLargestFactor, kLargestFactor);
  const double wanted =
      std::clamp(threshold * factor, double(goal_.smallest_threshold), double(goal_.largest_threshold));
  return static_cast<std::int32_t>(std::lround(wanted));
}

bool QualityControl::after_frame(std::size_t payload_bytes, CodecParameters& parameters) {
  bytes_ += payload_bytes;
  if (++frames_ < frames_per_decision_) return false;
  const CodecParameters before = parameters;
  parameters.threshold = next_threshold(before.threshold);
  if (statistics_.bodies > 0) {  // in a time without corrections nothing is learnt
    const CodecParameters wanted = trained_parameters(statistics_, parameters.threshold);
    parameters.position_step = follow(before.position_step, wanted.position_step);
    parameters.velocity_step = follow(before.velocity_step, wanted.velocity_step);
  }
  frames_ = 0;
  bytes_ = 0;
  statistics_ = {};
  return parameters != before;
}

}  // namespace tandem::server
