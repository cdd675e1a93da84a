#include "services/host/frames/trials.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

Trials::Trials(std::uint32_t streams, double frame_rate_hz, std::int64_t (*clock_ns)())
    : period_ns_(1e9 / frame_rate_hz), clock_ns_(clock_ns), figures_(streams) {}

double Trials::bytes_per_frame(std::uint32_t stream) const { return figures_[stream].ratio * mean_bytes_; }

void Trials::schedule(const ScheduledDrive& input) {
  // A shadow that cannot follow is of no use: the round goes on with the next stream.
  if (trial_ && !trial_->shadow.schedule(input)) trial_.reset();
}

void Trials::after_frame(const Mirror& mirror, std::span<const MadeDelta> made, const Begin& begin) {
  TANDEM_ASSERT(!made.empty());
  follow_reference(made.front());
  if (trial_) measure(mirror, made.front());
  if (trial_) return;
  if (!next_) consider_round();
  if (next_) next_trial(made, begin);
}

void Trials::follow_reference(const MadeDelta& first) {
  if (first.stream != reference_) {
    // Ratios to another stream say nothing. A round that was under way begins anew.
    reference_ = first.stream;
    mean_of_ = 0;
    mean_then_ = 0;
    for (Figures& figures : figures_) figures.ratio = 0;
    if (next_) next_ = 0;
    trial_.reset();
  }
  mean_of_ = std::min(mean_of_ + 1, kMeasured);
  mean_bytes_ += (static_cast<double>(first.payload.size()) - mean_bytes_) / mean_of_;
}

void Trials::consider_round() {
  ++paused_;
  const double change = mean_then_ > 0 ? mean_bytes_ / mean_then_ : 0;  // 0: not comparable
  const bool is_other =
      change > kOtherNature || (change > 0 && change < 1 / kOtherNature) || (change == 0 && mean_bytes_ > 0);
  const bool is_due =
      is_first_ ? paused_ >= kFirst : paused_ >= kMaxPause || (paused_ >= kLeastPause && is_other);
  if (!is_due) return;
  is_first_ = false;
  next_ = 0;
}

void Trials::next_trial(std::span<const MadeDelta> made, const Begin& begin) {
  const auto is_made = [&](std::uint32_t stream) {
    return std::ranges::any_of(made, [stream](const MadeDelta& each) { return each.stream == stream; });
  };
  for (; *next_ < figures_.size(); ++*next_) {
    if (is_made(*next_) || figures_[*next_].is_too_slow) continue;
    auto shadow = begin(*next_);
    if (!shadow) continue;
    trial_.emplace(Trial{.stream = *next_, .shadow = std::move(*shadow)});
    ++*next_;
    return;
  }
  next_.reset();
  paused_ = 0;
  mean_then_ = mean_bytes_;
  has_ended_ = true;
}

void Trials::measure(const Mirror& mirror, const MadeDelta& first) {
  Trial& trial = *trial_;
  const std::int64_t began_ns = clock_ns_ == nullptr ? 0 : clock_ns_();
  const std::size_t bytes = trial.shadow.produce(mirror).payload.size();
  if (clock_ns_ != nullptr) trial.took_ns += clock_ns_() - began_ns;
  ++trial.frames;
  if (static_cast<double>(trial.took_ns) > kMaxShare * period_ns_ * std::max(trial.frames, 8U)) {
    figures_[trial.stream] = {.ratio = 0, .is_too_slow = true};
    trial_.reset();
    return;
  }
  if (trial.frames <= kLearning) return;
  trial.bytes += bytes;
  trial.reference_bytes += first.payload.size();
  if (trial.frames < kLearning + kMeasured) return;
  // One byte more on both sides, so that a world at rest favours nobody.
  figures_[trial.stream].ratio =
      static_cast<double>(trial.bytes + 1) / static_cast<double>(trial.reference_bytes + 1);
  trial_.reset();
}

}  // namespace tandem::host
