#include "sdk/client/sampler.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

constexpr double kVelocityScale = 1.0 / 64;

}  // namespace

// Another epoch: whatever is alive in it is new.
void Sampler::begin(const Picture& picture) {
  epoch_ = picture.epoch;
  capacity_ = picture.agreed->alive.size();
  shown_.assign(3 * capacity_, 0);
  shown_turns_.assign(picture.agreed->has_orientations() ? capacity_ : 0, Rotation{0, 0, 0, 1});
  shown_alive_.assign(capacity_, 0);
  shown_generation_.assign(capacity_, 0);
  shown_jumps_.assign(capacity_, 0);
}

void Sampler::report_changes(const Picture& picture, Sample& out) {
  const DrawnFrame& agreed = *picture.agreed;
  const bool all_jumped = load_ != picture.load;
  for (std::size_t slot = 0; slot < capacity_; ++slot) {
    const bool was = shown_alive_[slot] != 0;
    const bool is = agreed.alive[slot] != 0;
    BodyChange change = BodyChange::kNone;
    if (is && (!was || shown_generation_[slot] != agreed.generation[slot])) {
      change = BodyChange::kNew;
    } else if (was && !is) {
      change = BodyChange::kGone;
    } else if (is && (all_jumped || shown_jumps_[slot] != agreed.jumps[slot])) {
      change = BodyChange::kJumped;
    }
    out.changes[slot] = change;
  }
  load_ = picture.load;
  shown_alive_ = agreed.alive;
  shown_generation_ = agreed.generation;
  shown_jumps_ = agreed.jumps;
}

void Sampler::interpolate(const Picture& picture, double share, Sample& out) {
  const DrawnFrame& agreed = *picture.agreed;
  const DrawnFrame& before = picture.before != nullptr ? *picture.before : agreed;
  for (std::size_t slot = 0; slot < capacity_; ++slot) {
    // Spawned or teleported between the two frames: it was never on the way from one place to the other.
    const bool jumped = before.jumps[slot] != agreed.jumps[slot];
    const double lag = jumped ? 0 : 1 - share;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const std::size_t at = 3 * slot + channel;
      double value = agreed.p[channel][slot];
      value -= (value - before.p[channel][slot]) * lag;
      shown_[at] = static_cast<float>(value);
      out.positions[at] = static_cast<float>(value * picture.lattice_unit);
    }
  }
}

void Sampler::extrapolate(const Picture& picture, double share, double beyond, double blend, double frames,
                          Sample& out) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto& p0 = picture.agreed->p[channel];
    const auto& p1 = picture.ahead->p[channel];
    const auto& v = picture.ahead->v[channel];
    for (std::size_t slot = 0; slot < capacity_; ++slot) {
      const std::size_t at = 3 * slot + channel;
      const double speed = v[slot] * kVelocityScale;
      double value = p0[slot] + (static_cast<double>(p1[slot]) - p0[slot]) * share + speed * beyond;
      // What was drawn, carried on at the body's speed, is where the eye expects it; the rest is a
      // correction.
      if (out.changes[slot] == BodyChange::kNone) value += (shown_[at] + speed * frames - value) * blend;
      shown_[at] = static_cast<float>(value);
      out.positions[at] = static_cast<float>(value * picture.lattice_unit);
    }
  }
}

void Sampler::show_turn(std::size_t slot, const Rotation& turn, Sample& out) {
  shown_turns_[slot] = turn;
  std::copy(turn.begin(), turn.end(), out.orientations.begin() + static_cast<std::ptrdiff_t>(4 * slot));
}

void Sampler::interpolate_turns(const Picture& picture, double share, Sample& out) {
  const DrawnFrame& agreed = *picture.agreed;
  const DrawnFrame& before = picture.before != nullptr ? *picture.before : agreed;
  const auto lag = static_cast<float>(1 - share);
  for (Slot slot = 0; slot < shown_turns_.size(); ++slot) {
    if (agreed.alive[slot] == 0) continue;
    Rotation turn = to_rotation(agreed.quaternion(slot));
    const bool jumped = before.jumps[slot] != agreed.jumps[slot];
    if (!jumped) turn = between(turn, to_rotation(before.quaternion(slot)), lag);
    show_turn(slot, turn, out);
  }
}

void Sampler::extrapolate_turns(const Picture& picture, double share, double beyond, double blend,
                                double frames, Sample& out) {
  const DrawnFrame& agreed = *picture.agreed;
  const DrawnFrame& ahead = *picture.ahead;
  for (Slot slot = 0; slot < shown_turns_.size(); ++slot) {
    if (agreed.alive[slot] == 0) continue;
    const Spin spin = ahead.spin(slot);
    Rotation turn = between(to_rotation(agreed.quaternion(slot)), to_rotation(ahead.quaternion(slot)),
                            static_cast<float>(share));
    if (beyond > 0) turn = turned_on(turn, spin, static_cast<float>(beyond));
    if (out.changes[slot] == BodyChange::kNone) {
      const Rotation expected = turned_on(shown_turns_[slot], spin, static_cast<float>(frames));
      turn = between(turn, expected, static_cast<float>(blend));
    }
    show_turn(slot, turn, out);
  }
}

void Sampler::sample(const Picture& picture, std::int64_t now_ns, SampleMode mode, Sample& out) {
  const DrawnFrame& agreed = *picture.agreed;
  const Pacer& pacer = picture.pacer;
  const bool had_orientations = !shown_turns_.empty();
  if (epoch_ != picture.epoch || capacity_ != agreed.alive.size() ||
      had_orientations != agreed.has_orientations())
    begin(picture);
  out.epoch = epoch_;
  out.capacity = static_cast<std::uint32_t>(capacity_);
  out.positions.resize(3 * capacity_);
  out.orientations.resize(4 * shown_turns_.size());
  out.changes.resize(capacity_);
  out.alive = agreed.alive;
  out.generation = agreed.generation;
  out.types = agreed.type;
  const auto applied = static_cast<double>(agreed.frame);
  const auto ahead = static_cast<double>(picture.ahead->frame - agreed.frame);
  const double elapsed_s = std::max(0.0, static_cast<double>(now_ns - last_ns_) / 1e9);
  report_changes(picture, out);
  if (mode == SampleMode::kInterpolate) {
    const double wanted = pacer.known() ? pacer.arrived_frame(now_ns) - 1 : applied;
    out.frame = std::clamp(wanted, applied - (picture.before != nullptr ? 1 : 0), applied);
    const double share = out.frame - (applied - 1);
    interpolate(picture, share, out);
    interpolate_turns(picture, share, out);
  } else {
    const double wanted = pacer.known() ? pacer.server_frame(now_ns) : applied;
    out.frame = std::clamp(wanted, applied, applied + ahead + 1);
    const double share = ahead > 0 ? std::min(1.0, (out.frame - applied) / ahead) : 1;
    const double beyond = std::max(0.0, out.frame - applied - ahead);
    const double blend = std::exp(-elapsed_s / kBlendS);
    const double frames = std::clamp(out.frame - last_frame_, -2.0, 2.0);
    extrapolate(picture, share, beyond, blend, frames, out);
    extrapolate_turns(picture, share, beyond, blend, frames, out);
  }
  last_ns_ = now_ns;
  last_frame_ = out.frame;
}

}  // namespace tandem::client
