#include "sdk/client/sampler.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

// Bits of marks_.
constexpr std::uint8_t kShown = 1;   // was alive in the previous sample
constexpr std::uint8_t kJumped = 2;  // teleported since the previous sample
constexpr std::uint8_t kBroken = 4;  // spawned or teleported in the last delta: previous_ is another place
constexpr std::uint8_t kFresh = 8;   // do not blend with shown_ in this sample
constexpr double kVelocityScale = 1.0 / 64;

}  // namespace

void Sampler::enable() {
  previous_.resize(std::size_t{3} * capacity_);
  shown_.resize(std::size_t{3} * capacity_);
  shown_generation_.resize(capacity_);
  marks_.resize(capacity_);
  enabled_ = true;
}

void Sampler::on_loaded() {
  has_previous_ = false;
  all_jumped_ = true;
}

void Sampler::before_apply(const ClientTimeline& timeline) {
  if (!enabled_) return;
  for (const Slot slot : broken_) marks_[slot] &= static_cast<std::uint8_t>(~kBroken);
  broken_.clear();
  const State& state = timeline.state(timeline.applied());
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto p = state.p(channel);
    for (std::size_t slot = 0; slot < capacity_; ++slot) previous_[3 * slot + channel] = p[slot];
  }
  has_previous_ = true;
}

void Sampler::after_apply(const ClientTimeline& timeline) {
  if (!enabled_) return;
  for (const LifecycleRecord& record : timeline.lifecycle()) {
    if (record.kind != LifecycleKind::kSpawn && record.kind != LifecycleKind::kTeleport) continue;
    marks_[record.slot] |= kBroken | kJumped;
    broken_.push_back(record.slot);
  }
}

void Sampler::report_changes(const State& state, Sample& out) {
  const auto alive = state.alive();
  const auto generation = state.generation();
  for (std::size_t slot = 0; slot < capacity_; ++slot) {
    const bool was = (marks_[slot] & kShown) != 0;
    const bool is = alive[slot] != 0;
    BodyChange change = BodyChange::kNone;
    if (is && (!was || shown_generation_[slot] != generation[slot])) {
      change = BodyChange::kNew;
    } else if (was && !is) {
      change = BodyChange::kGone;
    } else if (is && (all_jumped_ || (marks_[slot] & kJumped) != 0)) {
      change = BodyChange::kJumped;
    }
    out.changes[slot] = change;
    std::uint8_t marks = marks_[slot] & kBroken;
    if (is) marks |= kShown;
    if (is && change != BodyChange::kNone) marks |= kFresh;
    marks_[slot] = marks;
    shown_generation_[slot] = generation[slot];
  }
  all_jumped_ = false;
}

void Sampler::interpolate(const State& state, double share, Sample& out) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto p = state.p(channel);
    for (std::size_t slot = 0; slot < capacity_; ++slot) {
      const std::size_t at = 3 * slot + channel;
      double value = p[slot];
      if (has_previous_ && (marks_[slot] & kBroken) == 0) value -= (value - previous_[at]) * (1 - share);
      shown_[at] = static_cast<float>(value);
      out.positions[at] = static_cast<float>(value * unit_);
    }
  }
}

void Sampler::extrapolate(const State& from, const State& to, double share, double beyond, double blend,
                          double frames, Sample& out) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto p0 = from.p(channel);
    const auto p1 = to.p(channel);
    const auto v = to.v(channel);
    for (std::size_t slot = 0; slot < capacity_; ++slot) {
      const std::size_t at = 3 * slot + channel;
      const double speed = v[slot] * kVelocityScale;
      double value = p0[slot] + (static_cast<double>(p1[slot]) - p0[slot]) * share + speed * beyond;
      // What was drawn, carried on at the body's speed, is where the eye expects it; the rest is a
      // correction.
      if ((marks_[slot] & kFresh) == 0) value += (shown_[at] + speed * frames - value) * blend;
      shown_[at] = static_cast<float>(value);
      out.positions[at] = static_cast<float>(value * unit_);
    }
  }
}

void Sampler::sample(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns, SampleMode mode,
                     Sample& out) {
  if (!enabled_) enable();
  if (out.capacity != capacity_) {
    out.capacity = capacity_;
    out.positions.resize(std::size_t{3} * capacity_);
    out.alive.resize(capacity_);
    out.generation.resize(capacity_);
    out.types.resize(capacity_);
    out.changes.resize(capacity_);
  }
  const auto applied = static_cast<double>(timeline.applied());
  const auto ahead = static_cast<double>(timeline.now() - timeline.applied());
  const State& agreed = timeline.state(timeline.applied());
  const double elapsed_s = std::max(0.0, static_cast<double>(now_ns - last_ns_) / 1e9);
  report_changes(agreed, out);
  if (mode == SampleMode::kInterpolate) {
    const double wanted = pacer.known() ? pacer.arrived_frame(now_ns) - 1 : applied;
    out.frame = std::clamp(wanted, applied - (has_previous_ ? 1 : 0), applied);
    interpolate(agreed, out.frame - (applied - 1), out);
  } else {
    const double wanted = pacer.known() ? pacer.server_frame(now_ns) : applied;
    out.frame = std::clamp(wanted, applied, applied + ahead + 1);
    const double share = ahead > 0 ? std::min(1.0, (out.frame - applied) / ahead) : 1;
    extrapolate(agreed, timeline.state(timeline.now()), share, std::max(0.0, out.frame - applied - ahead),
                std::exp(-elapsed_s / kBlendS), std::clamp(out.frame - last_frame_, -2.0, 2.0), out);
  }
  last_ns_ = now_ns;
  last_frame_ = out.frame;
  std::copy(agreed.alive().begin(), agreed.alive().end(), out.alive.begin());
  std::copy(agreed.generation().begin(), agreed.generation().end(), out.generation.begin());
  std::copy(agreed.type().begin(), agreed.type().end(), out.types.begin());
}

}  // namespace tandem::client
