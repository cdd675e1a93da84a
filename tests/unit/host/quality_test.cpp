// Parameters that change while a session runs, set by hand or chosen by automatic quality.
#include "services/host/streams/quality.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/streams/residual_statistics.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

constexpr CodecParameters kStart{.threshold = 1000, .position_step = 100, .velocity_step = 100};

QualityControl control_of(const QualityGoal& goal, StepRule steps = StepRule::kFollow) {
  return {goal, steps, kStart, 1000, 30};
}

/// Tells `control` of one body that is corrected by so much.
void correct(QualityControl& control, std::int32_t position, std::int32_t velocity) {
  State predicted(1);
  predicted.spawn(0, 0, 0, {});
  State target = predicted;
  target.set_body(0, {{position, 0, 0}, {velocity, 0, 0}});
  control.observe(predicted, target, {.threshold = 1});
}

/// Runs frames of `bytes` each for `seconds`. Returns the parameters in force at the end.
CodecParameters run(QualityControl& control, int seconds, std::size_t bytes, CodecParameters parameters) {
  for (int frame = 0; frame < 30 * seconds; ++frame) control.after_frame(bytes, 10, parameters);
  return parameters;
}

constexpr std::size_t kMbitBytes = (1 << 20) / 8 / 30;  // a frame at 1 Mbit/s

TEST(Quality, DecidesFourTimesASecond) {
  QualityControl control =
      control_of({.target_mbit_per_s = 1, .smallest_threshold = 10, .largest_threshold = 9000});
  CodecParameters parameters = kStart;
  for (int frame = 1; frame < 8; ++frame) EXPECT_FALSE(control.after_frame(10 * kMbitBytes, 10, parameters));
  EXPECT_TRUE(control.after_frame(10 * kMbitBytes, 10, parameters));
}

TEST(Quality, SettlesNearTheTargetWhereBitsFallWithTheThreshold) {
  QualityControl control =
      control_of({.target_mbit_per_s = 1, .smallest_threshold = 10, .largest_threshold = 100000});
  CodecParameters parameters = kStart;
  double mbit = 0;
  for (int second = 0; second < 40; ++second) {
    mbit = 3000.0 / parameters.threshold;  // a scene that takes 3 Mbit/s at the start
    parameters = run(control, 1, static_cast<std::size_t>(mbit * kMbitBytes), parameters);
  }
  EXPECT_NEAR(mbit, 1, 0.05);
}

TEST(Quality, NeverLeavesItsLimits) {
  QualityControl control =
      control_of({.target_mbit_per_s = 1, .smallest_threshold = 400, .largest_threshold = 3000});
  EXPECT_EQ(run(control, 30, 100 * kMbitBytes, kStart).threshold, 3000) << "the stated maximum error";
  EXPECT_EQ(run(control, 60, 0, kStart).threshold, 400);
}

TEST(Quality, WithoutATargetTheThresholdStaysAndRangesFollowWhatIsCorrected) {
  QualityControl control = control_of({.smallest_threshold = 1000, .largest_threshold = 1000});
  correct(control, 127000, 1270);
  CodecParameters grown = kStart;
  while (!control.after_frame(500, 10, grown)) continue;
  EXPECT_EQ(grown.threshold, 1000);
  EXPECT_EQ(grown.position_step, 1100) << "1.1 times the largest residual, at once";
  EXPECT_EQ(grown.velocity_step, 97) << "down slowly";
  EXPECT_EQ(run(control, 10, 500, grown), grown) << "nothing was corrected: nothing was learnt";
}

TEST(Quality, RangesFollowBodiesThatAreCorrectedForTheirTurn) {
  QualityControl control({.smallest_threshold = 1000, .largest_threshold = 1000}, StepRule::kFollow, kStart,
                         1000, 30, {20'000});
  State predicted(1, {.orientation = true});
  predicted.spawn(0, 0, 0, {});
  State target = predicted;
  target.set_body(0, {.p = {900, 0, 0}, .v = {127'000, 0, 0}, .q = turned(kNoTurn, {1 << 28, 0, 0})});
  CodecParameters parameters = kStart;
  for (int decision = 0; decision < 3; ++decision) {
    control.observe(predicted, target, parameters);
    while (!control.after_frame(500, 10, parameters)) continue;
    EXPECT_EQ(parameters.velocity_step, 1100) << "decision " << decision;
  }
}

TEST(Quality, StepsOfTurnsFollowAsTheOthersDo) {
  CodecParameters parameters = kStart;
  parameters.turn_step = parameters.spin_step = 1000;
  QualityControl control({.smallest_threshold = 1000, .largest_threshold = 1000}, StepRule::kFollow,
                         parameters, 1000, 30, {50'000});
  State predicted(1, {.orientation = true});
  predicted.spawn(0, 0, 0, {});
  State target = predicted;
  target.set_quaternion(0, turned(kNoTurn, {1 << 26, 0, 0}));
  control.observe(predicted, target, parameters);
  while (!control.after_frame(500, 10, parameters)) continue;
  EXPECT_NEAR(parameters.turn_step * 127.0, 1.1 * (1 << 26), 1 << 18) << "at once";
  EXPECT_EQ(parameters.spin_step, 970) << "down slowly";
}

TEST(Quality, StepsOfACodecThatDoesNotReadThemStay) {
  QualityControl control =
      control_of({.smallest_threshold = 1000, .largest_threshold = 1000}, StepRule::kLeave);
  correct(control, 127000, 0);
  EXPECT_EQ(run(control, 1, 500, kStart), kStart);
  EXPECT_EQ(step_rule(*codec_traits("tracker")), StepRule::kLeave);
}

TEST(Quality, StepsThatCodeTablesWereTrainedForAreTheSmallestAndScaleWithTheThreshold) {
  QualityControl control = control_of({1, 10, 2000}, step_rule(*codec_traits("entropy")));
  CodecParameters parameters = kStart;
  for (int frame = 0; frame < 300; ++frame) {
    correct(control, 127, 0);
    control.after_frame(100 * kMbitBytes, 10, parameters);
  }
  EXPECT_EQ(parameters, (CodecParameters{.threshold = 2000, .position_step = 200, .velocity_step = 200}));
}

TEST(Quality, FinerThanAtTheStartOnlyWhereCorrectionsTellWhatItCosts) {
  const QualityGoal goal{.target_mbit_per_s = 1, .smallest_threshold = 10, .largest_threshold = 9000};
  QualityControl quiet = control_of(goal);
  CodecParameters parameters = kStart;
  for (int frame = 0; frame < 300; ++frame) quiet.after_frame(4, 0, parameters);
  EXPECT_EQ(parameters.threshold, kStart.threshold);
  parameters.threshold = 4000;
  for (int frame = 0; frame < 300; ++frame) quiet.after_frame(4, 0, parameters);
  EXPECT_EQ(parameters.threshold, kStart.threshold) << "what was coarse does not stay so";
  EXPECT_LT(run(quiet, 10, 4, kStart).threshold, kStart.threshold);
}

TEST(Quality, RisesFasterThanItFalls) {
  const QualityGoal goal{.target_mbit_per_s = 1, .smallest_threshold = 10, .largest_threshold = 9000};
  QualityControl high = control_of(goal), low = control_of(goal);
  CodecParameters risen = kStart, fallen = kStart;
  while (!high.after_frame(10 * kMbitBytes, 10, risen)) continue;
  while (!low.after_frame(kMbitBytes / 10, 10, fallen)) continue;
  EXPECT_EQ(risen.threshold, 2000);
  EXPECT_EQ(fallen.threshold, 800);
}

TEST(Quality, ATargetOutOfReachIsSaidAfterTwoSecondsAndTakenBackAfterTwo) {
  QualityControl control = control_of({1, 400, 1000});
  EXPECT_FALSE((run(control, 1, 3 * kMbitBytes, kStart), control.out_of_reach()));
  EXPECT_TRUE((run(control, 2, 3 * kMbitBytes, kStart), control.out_of_reach()));
  const CodecParameters finer{.threshold = 500};
  EXPECT_TRUE((run(control, 1, kMbitBytes, finer), control.out_of_reach()));
  EXPECT_FALSE((run(control, 2, kMbitBytes, finer), control.out_of_reach()));
}

TEST(Quality, ABudgetThatHoldsTheRateBelowTheTargetIsRefused) {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "limited";
  config.streams[0].layout.codec_tables = default_code_tables();
  config.streams[0].quality = QualityGoal{1, 1, kPositionLimit};
  config.streams[0].budget = least_budget(*config.streams[0].quality, config.frame_rate_hz);
  EXPECT_GT(config.streams[0].budget, kMbitBytes);
  EXPECT_NO_THROW(Bench bench(config));
  --config.streams[0].budget;
  EXPECT_THROW(Bench bench(config), std::runtime_error);
}

/// Payload of `seconds` of the scene at a fixed threshold.
std::uint64_t payload_bytes(const scenes::Scene& scene, const std::string& codec, bool automatic,
                            int seconds) {
  constexpr std::uint64_t kSeed = 1;
  sessions::SessionChoice choice;
  choice.bodies = 300;
  choice.codec = codec;
  choice.automatic = automatic;
  HostConfig config = sessions::plan_session(scene, choice).value();
  config.claim_ns = 0;
  const auto simulation = scenes::make_simulation(scene, choice.bodies, kSeed, 1).value();
  FakePort port(participant(0xAA));
  const auto host = Host::create(config, *simulation, port).value();
  const auto frames = static_cast<Frame>(seconds / scene.dt_s);
  std::int64_t now = kSecond;
  while (host->frame() < frames && now < 1000 * kSecond) {
    now += Bench::kPeriod;
    host->poll(now, now);
    while (host->outbox().pop(std::chrono::nanoseconds{0})) continue;
  }
  EXPECT_EQ(host->frame(), frames);
  return host->totals().payload_bytes;
}

TEST(Quality, AutomaticRangesCostHardlyMoreThanTrainedOnes) {
  const auto scene = scenes::load_scene("half_pipe_3");
  ASSERT_TRUE(scene);
  for (const char* codec : {"entropy", "limited"}) {
    const auto trained = static_cast<double>(payload_bytes(*scene, codec, false, 10));
    const auto automatic = static_cast<double>(payload_bytes(*scene, codec, true, 10));
    EXPECT_GT(trained, 10000) << "something was corrected";
    EXPECT_LT(automatic, 1.03 * trained) << codec;
  }
}

TEST(Quality, LimitsThatExcludeTheThresholdAreRefused) {
  EXPECT_TRUE(valid_goal({0, 1000, 1000}, kStart));
  EXPECT_FALSE(valid_goal({0, 1001, 2000}, kStart));
  EXPECT_FALSE(valid_goal({0, 1, 999}, kStart));
  EXPECT_FALSE(valid_goal({-1, 1, 2000}, kStart));
  EXPECT_FALSE(valid_goal({std::nan(""), 1, 2000}, kStart));
  EXPECT_FALSE(valid_goal({0, 0, 2000}, kStart));
  HostConfig config = test_config();
  config.streams[0].quality = QualityGoal{0, 1, 1};
  EXPECT_THROW(Bench bench(config), std::runtime_error);
}

/// A bench with a participant that keeps up and a second one whose snapshot a client timeline starts from.
class RuntimeQuality : public ::testing::Test {
 protected:
  explicit RuntimeQuality(HostConfig config = test_config()) : bench(std::move(config)) {
    bench.simulation.on_step = [this](std::uint64_t step) {
      for (auto& column : bench.simulation.position)
        column[1] += 0.05F * static_cast<float>(step % 7) - 0.15F;
    };
    bench.enter(2);
    bench.on_ms = [this] { bench.playing(2, bench.host->frame()); };
    bench.run_ms(100);
    bench.joining(1);
    bench.run_ms(300);
    const auto& session = bench.host->session();
    client.emplace(std::move(*ClientTimeline::create(session.streams[0].layout)));
    EXPECT_TRUE(client->load(bench.port.snapshots.back().bytes, session.epoch));
  }
  /// Lets the client apply all that was published; every hash is checked on the way.
  void follow() {
    for (const auto& delta : bench.port.deltas) {
      if (delta.frame <= client->applied()) continue;
      const auto applied = client->apply(delta.frame, delta.last_input, delta.hash, delta.payload);
      ASSERT_TRUE(applied) << applied.error().message;
    }
    EXPECT_EQ(client->hash(), bench.host->hash());
  }

  Bench bench;
  std::optional<ClientTimeline> client;
};

TEST_F(RuntimeQuality, ParametersSetByHandTravelInTheNextDeltaAndClientsFollow) {
  follow();
  StreamParameters coarse = bench.host->parameters();
  coarse.codec.threshold *= 16;
  coarse.codec.velocity_step *= 2;
  ASSERT_TRUE(bench.host->set_parameters(coarse));
  EXPECT_EQ(client->parameters(), test_config().streams[0].layout.parameters);
  const Frame before = bench.host->frame();
  bench.run_ms(40);
  ASSERT_EQ(bench.host->frame(), before + 1);
  follow();
  EXPECT_EQ(client->parameters(), coarse);
  bench.run_ms(500);
  follow();
}

TEST_F(RuntimeQuality, ParametersOutOfRangeAreRefusedAndChangeNothing) {
  StreamParameters bad = bench.host->parameters();
  bad.codec.position_step = 0;
  EXPECT_FALSE(bench.host->set_parameters(bad));
  EXPECT_EQ(bench.host->parameters(), test_config().streams[0].layout.parameters);
}

HostConfig automatic() {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "quantized";
  config.streams[0].quality = QualityGoal{0.005, config.streams[0].layout.parameters.codec.threshold,
                                          64 * config.streams[0].layout.parameters.codec.threshold};
  return config;
}

class AutomaticQuality : public RuntimeQuality {
 protected:
  AutomaticQuality() : RuntimeQuality(automatic()) {}
};

TEST_F(AutomaticQuality, TheHostFollowsItsTargetAndClientsFollowTheHost) {
  bench.run_ms(20'000);
  follow();
  EXPECT_NE(bench.host->parameters(), automatic().streams[0].layout.parameters);
  EXPECT_EQ(client->parameters(), bench.host->parameters());
  EXPECT_FALSE(bench.host->set_parameters(automatic().streams[0].layout.parameters))
      << "nobody else decides then";
}

HostConfig automatic_turns() {
  HostConfig config = turning_config();
  config.streams[0].layout.codec = "quantized";
  config.streams[0].layout.radii.assign(config.streams[0].layout.type_count, 100'000);
  CodecParameters& start = config.streams[0].layout.parameters.codec;
  start.turn_step = start.spin_step = kMaxStep;
  config.streams[0].quality = QualityGoal{0.001, start.threshold, 64 * start.threshold};
  return config;
}

class AutomaticTurns : public RuntimeQuality {
 protected:
  AutomaticTurns() : RuntimeQuality(automatic_turns()) {
    bench.simulation.on_step = [this](std::uint64_t step) {
      angle_ += 0.05F * static_cast<float>(step % 7) - 0.15F;
      bench.simulation.orientation[2][1] = std::sin(angle_);
      bench.simulation.orientation[3][1] = std::cos(angle_);
    };
  }
  float angle_ = 0;
};

TEST_F(AutomaticTurns, TheHostFollowsItsTargetWhereBodiesOnlyTurn) {
  bench.run_ms(20'000);
  follow();
  const CodecParameters before = automatic_turns().streams[0].layout.parameters.codec;
  const CodecParameters now = bench.host->parameters().codec;
  EXPECT_GT(now.threshold, before.threshold);
  EXPECT_LT(now.turn_step, before.turn_step / 2) << "down slowly";
  EXPECT_EQ(client->parameters(), bench.host->parameters());
}

TEST(AutomaticSession, StartsFromTheScenesThresholdBetweenAQuarterAndTheStatedError) {
  const auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  sessions::SessionChoice choice;
  choice.bodies = 1000;
  choice.automatic = true;
  choice.target_mbit_per_s = 0.5;
  auto plan = sessions::plan_session(*scene, choice);
  ASSERT_TRUE(plan);
  ASSERT_TRUE(plan->streams[0].quality);
  EXPECT_NEAR(plan->streams[0].layout.parameters.codec.threshold * plan->streams[0].lattice.unit,
              scene->threshold_m, 1e-6);
  EXPECT_NEAR(plan->streams[0].quality->smallest_threshold * plan->streams[0].lattice.unit,
              scene->threshold_m / 4, 1e-6);
  EXPECT_NEAR(plan->streams[0].quality->largest_threshold * plan->streams[0].lattice.unit,
              scene->threshold_m * 4, 1e-6);
  choice.max_error_m = scene->threshold_m / 2;
  plan = sessions::plan_session(*scene, choice);
  ASSERT_TRUE(plan) << "a smaller error is where it starts";
  EXPECT_TRUE(valid_goal(*plan->streams[0].quality, plan->streams[0].layout.parameters.codec));
  EXPECT_NEAR(plan->streams[0].layout.parameters.codec.threshold * plan->streams[0].lattice.unit,
              scene->threshold_m / 2, 1e-6);
  EXPECT_EQ(plan->streams[0].quality->largest_threshold, plan->streams[0].layout.parameters.codec.threshold);
}

TEST(ResidualStatistics, RangesAreATenthAboveTheLargestResidual) {
  ResidualStatistics statistics;
  statistics.largest_position = 127000;
  statistics.largest_velocity = 1270;
  const CodecParameters parameters = trained_parameters(statistics, 50);
  EXPECT_EQ(parameters.threshold, 50);
  EXPECT_EQ(parameters.position_step, 1100);
  EXPECT_EQ(parameters.velocity_step, 11);
}

TEST(ResidualStatistics, WithoutAResidualTheStepsAreOne) {
  const CodecParameters parameters = trained_parameters(ResidualStatistics(), 50);
  EXPECT_EQ(parameters.position_step, 1);
  EXPECT_EQ(parameters.velocity_step, 1);
}

TEST(ResidualStatistics, OnlyBodiesBeyondTheThresholdCount) {
  State predicted(3);
  for (Slot slot = 0; slot < 3; ++slot) predicted.spawn(slot, 0, 0, {});
  State target = predicted;
  target.p(0)[0] = 100;  // at the threshold, not beyond it
  target.v(0)[0] = 9999;
  target.p(1)[2] = -101;
  target.v(2)[2] = 40;
  ResidualStatistics statistics;
  statistics.frame(predicted, target, {100, 10, 20});
  EXPECT_EQ(statistics.bodies, 1U);
  EXPECT_EQ(statistics.largest_position, 101U);
  EXPECT_EQ(statistics.largest_velocity, 40U);
  EXPECT_EQ(statistics.position_counts[static_cast<std::uint8_t>(-10)], 1U);
  EXPECT_EQ(statistics.position_counts[0], 2U);
  EXPECT_EQ(statistics.velocity_counts[2], 1U);
}

TEST(ResidualStatistics, WithOrientationsBodiesCountWhoseSurfaceIsBeyond) {
  State predicted(3, {.orientation = true});
  for (Slot slot = 0; slot < 3; ++slot) predicted.spawn(slot, 0, slot == 2 ? 1 : 0, {});
  State target = predicted;
  // A turn of 0.1 rad: 100 units at a radius of 1000, 10 at one of 100.
  const Quaternion turn = turned(kNoTurn, {0, 0, (1 << 28) / 10});
  for (const Slot slot : {1U, 2U}) target.set_quaternion(slot, turn);
  target.p(0)[1] = 7;
  target.p(0)[2] = 50;
  ResidualStatistics statistics({1000, 100});
  statistics.frame(predicted, target, {90, 10, 20});
  EXPECT_EQ(statistics.bodies, 1U);
  EXPECT_EQ(statistics.largest_position, 7U);
  statistics.frame(predicted, target, {55, 10, 20});
  EXPECT_EQ(statistics.bodies, 3U);
  EXPECT_EQ(statistics.largest_position, 50U);
}

TEST(ResidualStatistics, TurnsCountWhereTheStreamHasThem) {
  State predicted(2, {.orientation = true});
  for (Slot slot = 0; slot < 2; ++slot) predicted.spawn(slot, 0, 0, {});
  State target = predicted;
  constexpr std::int32_t kRadian = 1 << 28;
  target.set_quaternion(1, turned(kNoTurn, {0, -kRadian / 4, 0}));
  target.w(2)[1] = kRadian / 100;
  const CodecParameters in_force{.threshold = 100, .turn_step = kRadian / 40, .spin_step = kRadian / 1000};
  ResidualStatistics statistics({1000});
  statistics.frame(predicted, target, in_force);
  EXPECT_EQ(statistics.bodies, 1U);
  EXPECT_NEAR(statistics.largest_turn, kRadian / 4, kRadian / 1000);
  EXPECT_EQ(statistics.largest_spin, static_cast<std::uint32_t>(kRadian / 100));
  EXPECT_EQ(statistics.turn_counts[static_cast<std::uint8_t>(-10)], 1U);
  EXPECT_EQ(statistics.turn_counts[0], 2U);
  EXPECT_EQ(statistics.spin_counts[10], 1U);
  const CodecParameters trained = trained_parameters(statistics, 100);
  EXPECT_NEAR(trained.turn_step * 127.0, 1.1 * kRadian / 4, kRadian / 500);
  EXPECT_NEAR(trained.spin_step * 127.0, 1.1 * kRadian / 100, 127);
  EXPECT_EQ(trained_tables(statistics).size(), 1024U);
  EXPECT_EQ(trained_tables(ResidualStatistics()).size(), 512U);
}

}  // namespace
}  // namespace tandem::host
