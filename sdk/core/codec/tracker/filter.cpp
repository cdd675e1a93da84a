#include "sdk/core/codec/tracker/filter.hpp"

#include <bit>

namespace tandem {
namespace {

// Converts steps to 1/256 of the threshold.
Vec3i relative(const TrackerSteps& steps) {
  return TrackerSteppings::relative(
      {std::clamp(steps[0], -127, 127), std::clamp(steps[1], -127, 127), std::clamp(steps[2], -127, 127)});
}

// The inverse of a vector's length: `root` / (2^30 * 2^halvings).
struct InverseLength {
  std::uint64_t root;
  unsigned halvings;
};

// Computes it from the square x > 0 of the length. With u = x / 4^halvings in 1/4 .. 1, Newton's iteration
// for 1 / sqrt(u),
//   y' = y (3 - u y^2) / 2,
// squares the relative error times 1.5: from the 0.1 of the line that it starts with to 1e-7 in three steps.
// y in 2^-30, at most 2; u in 2^-32; all products fit 64 bits.
InverseLength inverse_length(std::uint64_t x) {
  const auto leading = static_cast<unsigned>(std::countl_zero(x)) & ~1U;
  const std::uint64_t u = x << leading >> 32U;
  constexpr std::uint64_t kOne = std::uint64_t{1} << 30U;
  std::uint64_t y = (21 * kOne - 12 * (u >> 2U)) / 10;
  for (int i = 0; i < 3; ++i) y = y * (3 * kOne - (u * (y * y >> 30U) >> 32U)) >> 31U;
  return {y, 32 - leading / 2};
}

// The cosine, in 1/GainEvidence::kCosineOne, of two vectors with this product and these lengths.
std::int64_t cosine(std::int64_t product, const InverseLength& a, const InverseLength& b) {
  // product| is at most the product of the lengths, 2^bits.
  const unsigned bits = a.halvings + b.halvings;
  std::int64_t cosine = bits > 30 ? product >> (bits - 30) : product << (30 - bits);
  for (const InverseLength& each : {a, b}) cosine = cosine * static_cast<std::int64_t>(each.root) >> 30;
  return cosine;
}

}  // namespace

TrackerGains::TrackerGains(const TrackerKind& kind) : kind_(kind) {
  const CodecParameters usual;
  set(usual.velocity_gain, usual.acceleration_gain);
}

std::uint32_t TrackerGains::early() const { return kind_.early; }

void TrackerGains::set(std::uint16_t beta, std::uint16_t gamma) {
  if (beta == beta_ && gamma == gamma_) return;
  beta_ = beta;
  gamma_ = gamma;
  const std::int64_t share = std::int64_t{128} * beta;
  for (std::int64_t i = 0; i <= std::int64_t{kMaxAge}; ++i) {
    const std::int64_t k = std::max(i, kind_.least_k);
    const auto at = static_cast<std::size_t>(i);
    velocity_[at] = share / (i == 1 ? kind_.hit_k : k);
    acceleration_[at] = ((share * gamma) >> 16) / (k * k);
  }
}

void add_evidence(const TrackerBody& body, const TrackerSteps& steps, const Vec3i& c,
                  GainEvidence& evidence) {
  if (body.age == 0) return;  // the body was hit: its last correction says nothing about this one
  const auto squared = [](const Vec3i& vector) {
    return static_cast<std::uint64_t>(tracker_detail::dot(vector, vector));
  };
  const Vec3i now = relative(steps);
  const InverseLength inverse = inverse_length(squared(now));
  const Vec3i before = relative(body.steps);
  if (const std::uint64_t length = squared(before); length > 0) {
    evidence.agreement += cosine(tracker_detail::dot(now, before), inverse, inverse_length(length));
    ++evidence.repeated;
  }
  if (const std::uint64_t length = squared(c); length > 0) {
    evidence.forwardness += cosine(tracker_detail::dot(now, c), inverse, inverse_length(length));
    ++evidence.driven;
  }
}

TrackerFilter::TrackerFilter(const CodecParameters& parameters, const Vec3i& gravity, unsigned position_bits,
                             const TrackerGains& gains, std::span<const std::int32_t> radii)
    : coarse_(parameters.threshold, position_bits,
              radii.empty() ? TrackerSteppings::kAlone : TrackerSteppings::kJoint),
      fine_(parameters.threshold, position_bits, TrackerSteppings::kFine),
      gravity_(gravity),
      gains_(gains),
      radii_(radii) {
  // 256 / 64: c may move a body by four thresholds in a frame. With a larger c it would be corrected every
  // frame anyway. But the c that holds a body up is always permitted.
  std::int32_t fall = 0;
  for (const std::int32_t g : gravity) fall = std::max({fall, g, -g});
  most_c_ = std::max(std::int64_t{256} * parameters.threshold, std::int64_t{2} * fall);
  most_c_ = std::min<std::int64_t>(kVelocityLimit, most_c_);
}

// As move(), with an angle for `one`; w has the unit of angles, not 1/64 of it.
void TrackerFilter::turn(State& state, Slot slot, const TrackerTurningCorrection& correction,
                         TrackerBody& body) const {
  const TrackerSteps& steps = correction.turn;
  const tracker_detail::Meaning meaning(steps, body);
  const std::int64_t one = steppings(correction).angle_for(steps, radii_[state.type()[slot]]);
  const std::int64_t w_of_one = meaning.growth(one, meaning.velocity(gains_)) >> 6;
  WideSpin by{}, w{};
  for (std::size_t i = 0; i < 3; ++i) {
    by[i] = steps[i] * one;
    w[i] = state.w(i)[slot] + steps[i] * w_of_one;
  }
  const Turned turned = turned_by(state.quaternion(slot), by);
  state.set_quaternion(slot, turned.q);
  if (!turned.is_far) {
    const Spin kept = limited_spin(w);
    for (std::size_t i = 0; i < 3; ++i) state.w(i)[slot] = kept[i];
  }
  meaning.remember(body);
}

void TrackerFilter::settle(State& state, Slot slot, bool rest) const {
  state.rest()[slot] = static_cast<std::uint8_t>(rest);
  if (!rest) return;
  for (std::size_t i = 0; i < 3; ++i) {
    state.v(i)[slot] = 0;
    state.c(i)[slot] = -gravity_[i];
    if (state.groups().orientation) state.w(i)[slot] = 0;
  }
}

}  // namespace tandem
