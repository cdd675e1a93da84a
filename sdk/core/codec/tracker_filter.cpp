#include "sdk/core/codec/tracker_filter.hpp"

namespace tandem {
namespace {

// A position error that grew over k frames means a velocity error of d/k; beta of that is believed, and a
// part gamma of what that would be as an acceleration. Below kLeastK frames one correction says too little
// about either; but a body corrected twice running was hit: all of it is velocity, and more is believed.
constexpr std::int64_t kLeastK = 3;
constexpr std::int64_t kKOfTheHit = 2;
constexpr std::int64_t kBeta = 52429;  // 0.8, in 1/65536
constexpr std::int64_t kGamma = 9830;  // 0.15, in 1/65536
constexpr std::int64_t kMostGrowth = std::int64_t{1} << 29;

// x * share / 65536, rounded half up.
constexpr std::int64_t scaled(std::int64_t x, std::int64_t share) { return (x * share + 32768) >> 16; }

struct Gains {
  std::array<std::int64_t, kMostAge + 1> velocity{};      // 64 beta / k, in 1/65536
  std::array<std::int64_t, kMostAge + 1> acceleration{};  // 64 beta gamma / k^2, in 1/65536
};
constexpr Gains make_gains() {
  Gains gains;
  for (std::int64_t i = 0; i <= std::int64_t{kMostAge}; ++i) {
    const std::int64_t k = std::max(i, kLeastK);
    const auto at = static_cast<std::size_t>(i);
    const bool hit = i == 1;
    gains.velocity[at] = 64 * kBeta / (hit ? kKOfTheHit : k);
    gains.acceleration[at] = hit ? 0 : ((64 * kBeta * kGamma) >> 16) / (k * k);
  }
  return gains;
}
constexpr Gains kGains = make_gains();

std::int32_t limited(std::int64_t value, std::int64_t limit) {
  return static_cast<std::int32_t>(std::clamp(value, -limit, limit));
}

}  // namespace

void correct_body(State& state, Slot slot, const TrackerSteps& steps, const TrackerSteppings& steppings,
                  std::int32_t threshold, TrackerBody& body) {
  TrackerSteps now{};
  for (std::size_t i = 0; i < 3; ++i) now[i] = std::clamp(steps[i], -127, 127);
  const auto before = TrackerSteppings::relative({body.steps[0], body.steps[1], body.steps[2]});
  const auto after = TrackerSteppings::relative(now);
  std::int64_t dot = 0;
  for (std::size_t i = 0; i < 3; ++i) dot += std::int64_t{before[i]} * after[i];
  // Corrections that keep pointing the same way are believed more, in 1/256: 128 .. 384.
  const std::int64_t belief = 256 + (std::clamp<std::int64_t>(dot >> 8, -256, 256) >> 1);

  const std::uint32_t k = std::min(body.age + 1U, kMostAge);
  const auto d = steppings.distance(steps);
  const std::int64_t most_c = std::min<std::int64_t>(kVelocityLimit, std::int64_t{256} * threshold);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto grown = [&](std::int64_t gain) {
      return std::clamp((scaled(d[i], gain) * belief + 128) >> 8, -kMostGrowth, kMostGrowth);
    };
    std::int32_t& p = state.p(i)[slot];
    std::int32_t& v = state.v(i)[slot];
    std::int32_t& c = state.c(i)[slot];
    p = limited(p + d[i], kPositionLimit);
    v = limited(v + grown(kGains.velocity[k]), kVelocityLimit);
    c = limited(c + grown(kGains.acceleration[k]), most_c);
    body.steps[i] = static_cast<std::int8_t>(now[i]);
  }
  body.interval = static_cast<std::uint8_t>(k);
  body.age = 0;
}

}  // namespace tandem
