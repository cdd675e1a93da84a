#include "services/lab/measures/train.hpp"

#include <gtest/gtest.h>

#include "tests/unit/lab/bouncing.hpp"

namespace tandem::lab::of_train {
namespace {

constexpr std::uint32_t kBodies = 50;

Result<scenes::TrainedTable> train_on(float turn_rad_per_s) {
  scenes::Scene scene;
  scene.dt_s = Bouncing::kDt;
  scene.extent_m = 100;
  scene.threshold_m = 0.05;
  scene.turns = turn_rad_per_s != 0;
  scene.types.resize(1);
  scene.types[0].bounding_radius_m = 0.5;
  sessions::SessionChoice choice;
  choice.bodies = kBodies;
  const auto make = [&]() -> Result<Source> {
    return Source{std::make_unique<Bouncing>(kBodies, turn_rad_per_s), {}};
  };
  return train(scene, choice, make, 60, [](Frame) {});
}

TEST(Train, LearnsRangesAndCodeLengths) {
  const auto table = train_on(0);
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_GT(table->position_range_m, 0.05);
  EXPECT_EQ(table->position_code_lengths.size(), 256U);
  EXPECT_EQ(table->velocity_code_lengths.size(), 256U);
  EXPECT_EQ(table->turn_range_rad, 0);
  EXPECT_TRUE(table->turn_code_lengths.empty());
}

TEST(Train, LearnsThoseOfTurnsWhereBodiesTurn) {
  constexpr float kSpeed = 2;
  const auto table = train_on(kSpeed);
  ASSERT_TRUE(table) << table.error().message;
  // They turn about by 2 x 2 rad/s, which a frame later is 4/30 rad.
  EXPECT_NEAR(table->spin_range_rad_per_s, 1.1 * 2 * kSpeed, 0.05);
  EXPECT_GT(table->turn_range_rad, 0);
  EXPECT_LT(table->turn_range_rad, 1.2 * 2 * kSpeed * Bouncing::kDt);
  EXPECT_EQ(table->turn_code_lengths.size(), 256U);
  EXPECT_EQ(table->spin_code_lengths.size(), 256U);
}

}  // namespace
}  // namespace tandem::lab::of_train
