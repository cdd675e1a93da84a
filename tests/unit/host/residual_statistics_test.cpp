#include "services/host/streams/residual_statistics.hpp"

#include <gtest/gtest.h>

namespace tandem::host {
namespace {

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
