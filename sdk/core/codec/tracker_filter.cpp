#include "sdk/core/codec/tracker_filter.hpp"

#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

constexpr std::int64_t kMostGrowth = std::int64_t{1} << 29;

// A position error that grew over k frames means a velocity error of d/k; beta of that is believed, and a
// part gamma of what that would be as an acceleration. Below least_k frames one correction says too little
// about either; but a body corrected twice running was hit: all of it is velocity, and more is believed.
struct GainSet {
  std::int64_t beta;   // in 1/65536
  std::int64_t gamma;  // in 1/65536
  std::int64_t least_k;
  std::int64_t k_of_the_hit;
  std::uint32_t early;
};
constexpr GainSet kBallistic{52429, 9830, 3, 2, 19661};  // 0.8, 0.15
// Contacts are predicted: what is left grows slower, and there is no force to learn.
constexpr GainSet kContact{45875, 0, 3, 3, 19661};  // 0.7, 0
// Contacts in one step for several: they leave a force to learn.
constexpr GainSet kField{78643, 16384, 3, 3, 5243};  // 1.2, 0.25

TrackerGains make_gains(const GainSet& set) {
  TrackerGains gains;
  gains.early = set.early;
  for (std::int64_t i = 0; i <= std::int64_t{kMostAge}; ++i) {
    const std::int64_t k = std::max(i, set.least_k);
    const auto at = static_cast<std::size_t>(i);
    const bool hit = i == 1;
    gains.velocity[at] = 64 * set.beta / (hit ? set.k_of_the_hit : k);
    gains.acceleration[at] = hit ? 0 : ((64 * set.beta * set.gamma) >> 16) / (k * k);
  }
  return gains;
}

}  // namespace

const TrackerGains& tracker_gains(std::string_view predictor) {
  static const TrackerGains ballistic = make_gains(kBallistic);
  static const TrackerGains field = make_gains(kField);
  static const TrackerGains contact = make_gains(kContact);
  if (predictor == "field") return field;
  return predictor == "contact" ? contact : ballistic;
}

void correct_body(State& state, Slot slot, const TrackerSteps& steps, const TrackerSteppings& steppings,
                  std::int32_t threshold, const TrackerGains& gains, TrackerBody& body) {
  TrackerSteps now{};
  for (std::size_t i = 0; i < 3; ++i) now[i] = std::clamp(steps[i], -127, 127);
  const auto before = TrackerSteppings::relative({body.steps[0], body.steps[1], body.steps[2]});
  const auto after = TrackerSteppings::relative(now);
  std::int64_t dot = 0;
  for (std::size_t i = 0; i < 3; ++i) dot += std::int64_t{before[i]} * after[i];
  // Corrections that keep pointing the same way are believed more, in 1/256: 128 .. 384.
  const std::int64_t belief = 256 + (std::clamp<std::int64_t>(dot >> 8, -256, 256) >> 1);

  const std::uint32_t k = std::min(body.age + 1U, kMostAge);
  const std::int64_t one = steppings.unit_for(steps);
  const auto growth_of_one = [&](std::int64_t gain) {
    return std::min((share_of(one, gain) * belief + 128) >> 8, kMostGrowth);
  };
  const std::int64_t v_of_one = growth_of_one(gains.velocity[k]);
  const std::int64_t c_of_one = growth_of_one(gains.acceleration[k]);
  const std::int64_t most_c = std::min<std::int64_t>(kVelocityLimit, std::int64_t{256} * threshold);
  for (std::size_t i = 0; i < 3; ++i) {
    // |steps| < 2^31 and what one of them is worth is at most 2^30: products fit.
    const auto times = [&](std::int64_t worth, std::int64_t most) {
      return std::clamp(steps[i] * worth, -most, most);
    };
    std::int32_t& p = state.p(i)[slot];
    std::int32_t& v = state.v(i)[slot];
    std::int32_t& c = state.c(i)[slot];
    p = limited(p + times(one, TrackerSteppings::kMostDistance), kPositionLimit);
    v = limited(v + times(v_of_one, kMostGrowth), kVelocityLimit);
    c = limited(c + times(c_of_one, kMostGrowth), most_c);
    body.steps[i] = static_cast<std::int8_t>(now[i]);
  }
  body.interval = static_cast<std::uint8_t>(k);
  body.age = 0;
}

}  // namespace tandem
