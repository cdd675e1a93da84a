#include "sdk/core/codec/tracker/filter.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sdk/core/codec/rounding.hpp"
#include "sdk/core/codec/tracker/steps.hpp"

namespace tandem {
namespace {

constexpr std::int32_t kThreshold = 4096;

const TrackerGains kGains(TrackerKind{});

TrackerFilter filter_of(std::int32_t threshold, const Vec3i& gravity = {}) {
  CodecParameters parameters;
  parameters.threshold = threshold;
  return {parameters, gravity, 0, kGains};
}

State one_body() {
  State state(1);
  state.spawn(0, 0, 0, {});
  return state;
}

TEST(TrackerFilter, SplitsACorrectionAmongPositionVelocityAndAcceleration) {
  State state = one_body();
  TrackerBody body;
  body.age = 9;
  filter_of(kThreshold).move(state, 0, {{2, 0, 0}}, body);
  const std::int32_t d = 2 * 3891;  // 0.95 * 4096, down
  EXPECT_EQ(state.p(0)[0], d);
  EXPECT_NEAR(state.v(0)[0], 64 * 0.8 * d / 10, 8);
  EXPECT_NEAR(state.c(0)[0], 64 * 0.8 * 0.15 * d / 100, 2);
  EXPECT_EQ(state.p(1)[0], 0);
  EXPECT_EQ(state.v(1)[0], 0);
  EXPECT_EQ(body.age, 0U);
  EXPECT_EQ(body.interval, 10U);
  EXPECT_EQ(body.steps, (TrackerSteps{2, 0, 0}));
}

TEST(TrackerFilter, OfABodyCorrectedTwiceRunningMoreIsBelievedToBeVelocity) {
  State state = one_body();
  TrackerBody body;
  filter_of(kThreshold).move(state, 0, {{2, 0, 0}}, body);
  EXPECT_NEAR(state.v(0)[0], 64 * 0.8 * (2 * 3891) / 2, 8);
  EXPECT_NEAR(state.c(0)[0], 64 * 0.8 * 0.15 * (2 * 3891) / 9, 8);
}

TEST(TrackerFilter, TakesALongStepOfABodyCorrectedInTheFrameBeforeAsAnErrorOfVelocity) {
  State state = one_body();
  TrackerBody body;
  body.steps = {0, -2, 0};  // the opposite way, which counts for nothing here
  filter_of(kThreshold).move(state, 0, {{0, 3, 0}}, body);
  EXPECT_EQ(state.v(1)[0], 64 * 3 * 3891);
  EXPECT_NEAR(state.c(1)[0], 64 * 0.8 * 0.15 * (3 * 3891) / 9, 8);
}

TEST(TrackerFilter, AfterAFrameWithoutACorrectionTakesALongStepAsAnyOther) {
  State state = one_body();
  TrackerBody body;
  body.age = 1;
  filter_of(kThreshold).move(state, 0, {{0, 3, 0}}, body);
  EXPECT_LT(state.v(1)[0], 64 * 3 * 3891 / 2);
}

TEST(TrackerFilter, ABodyPutToRestHoldsItselfUp) {
  State state = one_body();
  state.v(1)[0] = 700;
  TrackerBody body;
  const TrackerFilter filter = filter_of(kThreshold, {0, -640, 3});
  filter.move(state, 0, {{0, 1, 0}}, body);
  filter.settle(state, 0, true);
  EXPECT_EQ(state.rest()[0], 1);
  EXPECT_GT(state.p(1)[0], 0);
  EXPECT_EQ(state.v(1)[0], 0);
  EXPECT_EQ((Vec3i{state.c(0)[0], state.c(1)[0], state.c(2)[0]}), (Vec3i{0, 640, -3}));
  filter.move(state, 0, {{0, 1, 0}}, body);
  filter.settle(state, 0, false);
  EXPECT_EQ(state.rest()[0], 0);
  EXPECT_GT(state.v(1)[0], 0);
}

TEST(TrackerFilter, AccelerationReachesWhatHoldsABodyUpAtAnyThreshold) {
  constexpr std::int32_t kGravity = 1 << 20;
  State state = one_body();
  TrackerBody body;
  for (int i = 0; i < 100'000; ++i) filter_of(1, {0, -kGravity, 0}).move(state, 0, {{0, 127, 0}}, body);
  EXPECT_EQ(state.c(1)[0], 2 * kGravity);
}

TEST(TrackerFilter, BelievesCorrectionsThatKeepTheirDirectionMore) {
  const auto velocity_after = [](std::int8_t last) {
    State state = one_body();
    TrackerBody body{9, 5, {last, 0, 0}};
    filter_of(kThreshold).move(state, 0, {{2, 0, 0}}, body);
    return state.v(0)[0];
  };
  EXPECT_NEAR(velocity_after(2), 1.5 * velocity_after(0), 4);
  EXPECT_NEAR(velocity_after(-2), 0.5 * velocity_after(0), 4);
}

TEST(TrackerFilter, KeepsEveryColumnInItsLimits) {
  for (const std::int32_t sign : {-1, 1}) {
    State state = one_body();
    TrackerBody body;
    for (int i = 0; i < 20; ++i) {
      const std::int32_t far = sign * kMaxTrackerSteps;
      filter_of(kPositionLimit).move(state, 0, {{far, far, far}}, body);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(state.p(i)[0], sign * kPositionLimit);
      EXPECT_EQ(state.v(i)[0], sign * kVelocityLimit);
      EXPECT_EQ(std::abs(state.c(i)[0]), kVelocityLimit);
    }
  }
}

TEST(TrackerFilter, EvidenceIsTheCosineOfCorrections) {
  const auto near = [](std::int64_t sum, double cosine) {
    return std::abs(static_cast<double>(sum) / GainEvidence::kCosineOne - cosine) < 1e-6;
  };
  const auto evidence_of = [](const TrackerSteps& last, const TrackerSteps& steps, const Vec3i& c) {
    GainEvidence evidence;
    add_evidence({9, 5, last}, steps, c, evidence);
    return evidence;
  };
  EXPECT_PRED2(near, evidence_of({3, 0, 0}, {5, 0, 0}, {}).agreement, 1.0);
  EXPECT_PRED2(near, evidence_of({3, 0, 0}, {-5, 0, 0}, {}).agreement, -1.0);
  EXPECT_PRED2(near, evidence_of({3, 0, 0}, {0, 5, 0}, {}).agreement, 0.0);
  EXPECT_PRED2(near, evidence_of({3, 3, 0}, {127, 0, 0}, {}).agreement, std::sqrt(0.5));
  EXPECT_PRED2(near, evidence_of({0, 0, 0}, {4, 4, 4}, {0, 0, -1}).forwardness, -std::sqrt(1.0 / 3));
  const std::int32_t most = kVelocityLimit;
  EXPECT_PRED2(near, evidence_of({0, 0, 0}, {127, 127, 127}, {most, most, most}).forwardness, 1.0);
  EXPECT_EQ(evidence_of({0, 0, 0}, {1, 0, 0}, {}).repeated, 0U);
  EXPECT_EQ(evidence_of({1, 0, 0}, {1, 0, 0}, {1, 0, 0}).driven, 1U);
}

TEST(TrackerFilter, SmallStepsAreShorterTheMoreAxesMove) {
  const TrackerSteppings steppings(1000);
  EXPECT_EQ(steppings.unit_for({1, 0, 0}), 919);
  EXPECT_EQ(steppings.unit_for({0, -1, 1}), 690);
  EXPECT_EQ(steppings.unit_for({1, 1, -1}), 589);
  EXPECT_EQ(steppings.unit_for({2, 1, 0}), 949);
}

TEST(TrackerFilter, StepsAreMultiplesOfWhatPositionsAreRoundedTo) {
  const TrackerSteppings steppings(1000, 5);
  EXPECT_EQ(steppings.unit_for({1, 0, 0}), 896);
  EXPECT_EQ(steppings.unit_for({0, -1, 1}), 672);
  EXPECT_EQ(steppings.unit_for({1, 1, -1}), 576);
  EXPECT_EQ(steppings.unit_for({2, 1, 0}), 928);
  EXPECT_EQ(TrackerSteppings(100, 24).unit_for({1, 0, 0}), 1 << 24) << "whatever another writer asks for";
}

TEST(TrackerSteps, FindsAPointInTheErrorBallForEveryDirectionAndThreshold) {
  TrackerCosts costs;
  costs.learn(TrackerModels());
  for (const std::int32_t threshold : {1, 2, 3, 4, 5, 7, 10, 11, 16, 17, 31}) {
    const TrackerSteppings steppings(threshold, rounding_for(threshold).p);
    const ErrorWorth worth(threshold, 14);
    const std::int32_t reach = 3 * threshold + 2;
    for (std::int32_t x = -reach; x <= reach; ++x) {
      for (std::int32_t y = 0; y <= reach; ++y) {
        for (std::int32_t z = 0; z <= y; ++z) {
          if (x * x + y * y + z * z <= threshold * threshold) continue;
          TrackerSteps steps{};
          ASSERT_TRUE(choose_steps({}, {x, y, z}, steppings, worth, costs, {}, steps))
              << threshold << ": " << x << " " << y << " " << z;
        }
      }
    }
  }
}

}  // namespace
}  // namespace tandem
