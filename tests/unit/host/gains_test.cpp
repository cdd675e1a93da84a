// Decay and gains that the server chooses while a session runs.
#include "services/host/streams/gains.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host::of_gains {
namespace {

constexpr std::uint32_t kBodies = 1000;
constexpr StreamParameters kStart{.codec = {.threshold = 1000, .velocity_gain = 26214},
                                  .step = {.decay = 3000}};

/// The sum of as many cosines.
std::int64_t cosines(double each, std::uint64_t count) {
  return std::llround(each * static_cast<double>(GainEvidence::kCosineOne) * static_cast<double>(count));
}

/// Decisions on corrections that all have these cosines; the parameters in force at the end.
StreamParameters decide(double agreement, double forwardness, int decisions,
                        std::uint64_t corrections = 600) {
  GainControl control({}, kBodies, kStart);
  StreamParameters parameters = kStart;
  for (int frame = 0; frame < 15 * decisions; ++frame) {
    if (frame % 15 == 0)
      control.observe(
          {cosines(agreement, corrections), corrections, cosines(forwardness, corrections), corrections});
    control.after_frame(parameters);
  }
  return parameters;
}

TEST(Gains, GrowWhereCorrectionsAgreeAndShrinkWhereTheyDoNot) {
  EXPECT_GT(decide(0.6, 0.2, 20).codec.velocity_gain, kStart.codec.velocity_gain);
  EXPECT_LT(decide(-0.1, 0.2, 20).codec.velocity_gain, kStart.codec.velocity_gain);
}

TEST(Gains, TheLearnedAccelerationIsKeptWhileCorrectionsFollowIt) {
  const StreamParameters kept = decide(0.25, 0.6, 5);
  const StreamParameters dropped = decide(0.25, -0.3, 5);
  EXPECT_LT(kept.step.decay, kStart.step.decay);
  EXPECT_GT(dropped.step.decay, kStart.step.decay);
  EXPECT_GT(kept.codec.acceleration_gain, dropped.codec.acceleration_gain);
}

TEST(Gains, StayWhereCorrectionsAreAsWantedOrTooFew) {
  EXPECT_EQ(decide(0.25, 0.2, 50), kStart);
  EXPECT_EQ(decide(0.6, -0.3, 50, 0), kStart);
  EXPECT_EQ(decide(0.6, -0.3, 2, 2), kStart) << "two of a thousand bodies say little";
}

TEST(Gains, StayInTheirLimitsForEver) {
  const StreamParameters most = decide(1, 1, 1000);
  const StreamParameters least = decide(-1, -1, 1000);
  const auto near_limit = [](double value, double limit) { return std::abs(value / limit - 1) < 0.31; };
  EXPECT_PRED2(near_limit, most.codec.velocity_gain / 32768.0, 1.8);
  EXPECT_PRED2(near_limit, least.codec.velocity_gain / 32768.0, 0.35);
  EXPECT_PRED2(near_limit, most.step.decay, 15);
  EXPECT_PRED2(near_limit, least.step.decay, 60000);
}

TEST(Gains, AreDecidedEveryFifteenFrames) {
  GainControl control({}, kBodies, kStart);
  StreamParameters parameters = kStart;
  for (int frame = 1; frame <= 15; ++frame) {
    control.observe({.forwardness = cosines(-0.5, 100), .driven = 100});
    EXPECT_EQ(control.after_frame(parameters), frame == 15);
  }
}

TEST(Gains, AreChosenAtRunTimeForTrackerAlone) {
  const auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  sessions::SessionChoice choice;
  choice.bodies = 1000;
  EXPECT_TRUE(sessions::plan_session(*scene, choice)->streams[0].gains);
  choice.codec = "entropy";
  EXPECT_FALSE(sessions::plan_session(*scene, choice)->streams[0].gains);
}

TEST(GainsOfASession, TravelInDeltasAndClientsFollow) {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "tracker";
  config.streams[0].layout.codec_tables.clear();
  config.streams[0].layout.parameters.step.decay = 13000;
  config.streams[0].gains = GainGoal{};
  Bench bench(config);
  bench.simulation.on_step = [&](std::uint64_t step) {  // to and fro: no force is worth remembering
    for (auto& column : bench.simulation.position) {
      for (float& p : column) p += step % 16 < 8 ? 0.07F : -0.07F;
    }
  };
  bench.enter(2);
  bench.on_ms = [&] { bench.playing(2, bench.host->frame()); };
  bench.run_ms(100);
  bench.joining(1);
  bench.run_ms(300);
  auto client = *ClientTimeline::create(bench.host->session().streams[0].layout);
  ASSERT_TRUE(client.load(bench.port.snapshots.back().bytes, bench.host->session().epoch));
  bench.run_ms(20'000);
  for (const auto& delta : bench.port.deltas) {
    if (delta.frame <= client.applied()) continue;
    const auto applied = client.apply(delta.frame, delta.last_input, delta.hash, delta.payload);
    ASSERT_TRUE(applied) << applied.error().message;
  }
  EXPECT_NE(bench.host->parameters(), config.streams[0].layout.parameters);
  EXPECT_EQ(client.parameters(), bench.host->parameters());
}

}  // namespace
}  // namespace tandem::host::of_gains
