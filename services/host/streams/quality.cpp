#include "services/host/streams/quality.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/units.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tandem::host {
namespace {

// Maximum factors on the threshold in one decision. It rises faster than it falls, because a stream that is
// too fine takes bandwidth from others on the link.
constexpr double kMaxRise = 2, kMaxFall = 0.8;
constexpr double kDeadBand = 0.03;  // around the target, so that a calm scene is left alone
// With fewer corrections, as a share of the bodies in a frame, nothing can be learned about the cost of a
// finer threshold when something moves.
constexpr double kQuiet = 0.001;
constexpr int kPressed = 8;          // decisions, two seconds
constexpr double kLeastRoom = 1.25;  // minimum ratio of the budget to the target
// A range grows at once and shrinks slowly. A range that is too small costs error, one that is too large
// costs only bits.
constexpr double kShrink = 0.97;
// Under a cap: the aim below what frames may take if all are alike, so that what they may take besides is
// left for bursts; and of how many frames one may be full.
constexpr double kFill = 0.95;
constexpr std::uint32_t kFullShare = 2;
// A codec may leave some of its budget unused.
constexpr std::size_t kSpareShare = 16;

}  // namespace

bool valid_goal(const QualityGoal& goal, const CodecParameters& parameters) {
  return std::isfinite(goal.target_mbit_per_s) && goal.target_mbit_per_s >= 0 &&
         goal.smallest_threshold >= 1 && goal.smallest_threshold <= parameters.threshold &&
         parameters.threshold <= goal.largest_threshold && goal.largest_threshold <= kPositionLimit;
}

QualityGoal quality_goal(const Lattice& lattice, double target_mbit_per_s, double finest, double coarsest) {
  const auto units = [&lattice](double distance) {
    return static_cast<std::int32_t>(
        std::clamp(std::round(distance * lattice.position_scale()), 1.0, double{kPositionLimit}));
  };
  return {target_mbit_per_s, units(finest), units(coarsest)};
}

StepRule step_rule(const CodecTraits& traits) {
  if (traits.reads_gains) return StepRule::kLeave;
  return traits.takes_tables ? StepRule::kFollowAbove : StepRule::kFollow;
}

std::size_t least_budget(const QualityGoal& goal, double frame_rate_hz) {
  return static_cast<std::size_t>(
      std::ceil(kLeastRoom * goal.target_mbit_per_s * kBitsPerMbit / 8 / frame_rate_hz));
}

QualityControl::QualityControl(const QualityGoal& goal, StepRule steps, const CodecParameters& start,
                               std::uint32_t bodies, double frame_rate_hz, std::vector<std::int32_t> radii)
    : goal_(goal),
      radii_(std::move(radii)),
      steps_(steps),
      start_(start),
      bodies_(bodies),
      frame_rate_hz_(frame_rate_hz),
      frames_per_decision_(static_cast<std::uint32_t>(std::clamp(std::lround(frame_rate_hz / 4), 1L, 1000L))),
      statistics_(radii_) {
  TANDEM_ASSERT(frame_rate_hz > 0 && bodies > 0);
}

double QualityControl::ratio() const {
  if (fair_bytes_ > 0) {
    // What did not fit is not known, so frames that are full count as twice too large.
    const bool full = kFullShare * full_ >= frames_;
    return std::max(static_cast<double>(bytes_) / (kFill * static_cast<double>(fair_bytes_)),
                    full ? 2.0 : 0.0);
  }
  const double mbit_per_s = static_cast<double>(bytes_) * 8 / kBitsPerMbit * frame_rate_hz_ / frames_;
  return mbit_per_s / goal_.target_mbit_per_s;
}

std::int32_t QualityControl::next_threshold(std::int32_t threshold) const {
  if (std::abs(ratio() - 1) <= kDeadBand) return threshold;
  // Bits fall with about the inverse of the threshold. The square root avoids overshooting.
  const double factor = std::clamp(std::sqrt(std::max(ratio(), 1e-3)), kMaxFall, kMaxRise);
  const bool quiet = static_cast<double>(corrected_) < kQuiet * bodies_ * frames_;
  const std::int32_t finest = quiet ? std::min(start_.threshold, threshold) : goal_.smallest_threshold;
  return static_cast<std::int32_t>(
      std::lround(std::clamp(threshold * factor, double(finest), double(goal_.largest_threshold))));
}

CodecParameters QualityControl::with_steps(CodecParameters parameters) const {
  // Nothing is learned without corrections.
  if (steps_ == StepRule::kLeave || statistics_.bodies == 0) return parameters;
  const CodecParameters wanted = trained_parameters(statistics_, parameters.threshold);
  const auto follow = [&](std::int32_t step, std::int32_t needed, std::int32_t trained) {
    double least = step * kShrink;
    if (steps_ == StepRule::kFollowAbove) {
      least = std::max(least, static_cast<double>(trained) * parameters.threshold / start_.threshold);
    }
    return std::max(needed, static_cast<std::int32_t>(std::min(std::ceil(least), double{kMaxStep})));
  };
  parameters.position_step = follow(parameters.position_step, wanted.position_step, start_.position_step);
  parameters.velocity_step = follow(parameters.velocity_step, wanted.velocity_step, start_.velocity_step);
  if (!has_turn_steps(parameters)) return parameters;
  parameters.turn_step = follow(parameters.turn_step, wanted.turn_step, start_.turn_step);
  parameters.spin_step = follow(parameters.spin_step, wanted.spin_step, start_.spin_step);
  return parameters;
}

void QualityControl::judge(std::int32_t threshold) {
  const bool pressed = threshold == goal_.largest_threshold && ratio() > 1 + kDeadBand;
  pressed_ = std::clamp(pressed_ + (pressed ? 1 : -1), 0, kPressed);
  if (pressed_ == kPressed) out_of_reach_ = true;
  if (pressed_ == 0) out_of_reach_ = false;
}

bool QualityControl::after_frame(std::size_t payload_bytes, std::uint32_t corrected,
                                 CodecParameters& parameters, const FrameBudget& budget) {
  bytes_ += payload_bytes;
  corrected_ += corrected;
  fair_bytes_ += budget.fair;
  if (budget.fair > 0 && payload_bytes + budget.most / kSpareShare >= budget.most) ++full_;
  if (++frames_ < frames_per_decision_) return false;
  const CodecParameters before = parameters;
  if (has_goal()) {
    judge(before.threshold);
    parameters.threshold = next_threshold(before.threshold);
  }
  parameters = with_steps(parameters);
  TANDEM_ASSERT(valid_goal(goal_, parameters) && valid_parameters(parameters));
  frames_ = 0;
  bytes_ = 0;
  corrected_ = 0;
  fair_bytes_ = 0;
  full_ = 0;
  statistics_ = ResidualStatistics(radii_);
  return parameters != before;
}

}  // namespace tandem::host
