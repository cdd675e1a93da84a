#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/host/streams/lattice_choice.hpp"

namespace tandem::host {
namespace {

constexpr double kDt = 1.0 / 30;

TEST(LatticeChoice, UnitIsTheThresholdHalvedTwelveTimesInASmallWorld) {
  const auto lattice = choose_lattice(0.02, 10, kDt);
  ASSERT_TRUE(lattice);
  EXPECT_EQ(lattice->halvings, 12);
  EXPECT_EQ(lattice->unit, 0.02 / 4096);
}

TEST(LatticeChoice, FourTimesTheWorldFitsThePositions) {
  for (const double extent : {1.0, 1000.0, 1310.0, 1400.0, 5000.0, 20000.0}) {
    const auto lattice = choose_lattice(0.02, extent, kDt);
    ASSERT_TRUE(lattice) << extent;
    EXPECT_LE(4 * extent / lattice->unit, double{kPositionLimit});
    const bool finer_fits = 4 * extent / (lattice->unit / 2) <= double{kPositionLimit};
    EXPECT_TRUE(lattice->halvings == 12 || !finer_fits) << extent;
  }
}

TEST(LatticeChoice, RefusesAWorldTooLargeForEightHalvings) {
  // 2^30 units of threshold / 2^8, over four.
  const double largest = 0.02 / 256 * kPositionLimit / 4;
  EXPECT_EQ(choose_lattice(0.02, largest, kDt)->halvings, 8);
  const auto refused = choose_lattice(0.02, largest * 1.001, kDt);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("too fine"), std::string::npos);
}

TEST(LatticeChoice, RefusesNonsense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(choose_lattice(bad, 10, kDt));
    EXPECT_FALSE(choose_lattice(0.02, bad, kDt));
    EXPECT_FALSE(choose_lattice(0.02, 10, bad));
  }
}

TEST(CodecParametersOf, ThresholdIsAPowerOfTwoOfUnitsWhenItIsTheSmallest) {
  const auto lattice = *choose_lattice(0.02, 10, kDt);
  EXPECT_EQ(codec_parameters(lattice, 0.02, 0, 0)->threshold, 4096);
  EXPECT_EQ(codec_parameters(lattice, 0.03, 0, 0)->threshold, 6144);
}

TEST(CodecParametersOf, StepsCoverTheRange) {
  const auto lattice = *choose_lattice(0.02, 10, kDt);
  const auto parameters = codec_parameters(lattice, 0.02, 0.1, 3);
  ASSERT_TRUE(parameters);
  EXPECT_GE(parameters->position_step * 127 * lattice.unit, 0.1);
  EXPECT_LT((parameters->position_step - 1) * 127 * lattice.unit, 0.1);
  EXPECT_GE(parameters->velocity_step * 127 / lattice.velocity_scale(), 3);
}

TEST(CodecParametersOf, RefusesWhatDoesNotFit) {
  const auto lattice = *choose_lattice(0.02, 10, kDt);
  EXPECT_FALSE(codec_parameters(lattice, 0, 0, 0));
  EXPECT_FALSE(codec_parameters(lattice, std::nan(""), 0, 0));
  EXPECT_FALSE(codec_parameters(lattice, 0.02, -1, 0));
  EXPECT_FALSE(codec_parameters(lattice, 0.02, 0, std::nan("")));
  EXPECT_FALSE(codec_parameters(lattice, lattice.unit / 4, 0, 0));
}

TEST(TurnStepsOf, CoverTheRangeAndAreOfTheSurfaceWhereNothingWasTrained) {
  const auto lattice = *choose_lattice(0.02, 10, kDt);
  auto parameters = *codec_parameters(lattice, 0.02, 0, 0);
  ASSERT_TRUE(set_turn_steps(lattice, 0.5, 3, 0.2, parameters));
  EXPECT_NEAR(std::ldexp(parameters.turn_step, -28) * 127, 0.5, 1e-5);
  EXPECT_NEAR(std::ldexp(parameters.spin_step, -28) * 127 / kDt, 3, 1e-4);
  ASSERT_TRUE(set_turn_steps(lattice, 0, 0, 0.2, parameters));
  EXPECT_NEAR(std::ldexp(parameters.turn_step, -28) * 127 * 0.2, 8 * 0.02, 1e-5);
  EXPECT_EQ(parameters.spin_step, parameters.turn_step);
  ASSERT_TRUE(set_turn_steps(lattice, 1e9, 1e9, 0.2, parameters));
  EXPECT_TRUE(valid_parameters(parameters));
  EXPECT_FALSE(set_turn_steps(lattice, -1, 0, 0.2, parameters));
  EXPECT_FALSE(set_turn_steps(lattice, 0, std::nan(""), 0.2, parameters));
  EXPECT_FALSE(set_turn_steps(lattice, 0, 0, 0, parameters));
}

TEST(ToDrive, ConvertsGravityAndDampingToThePredictedStepsIntegers) {
  const auto lattice = *choose_lattice(1.0 / 64, 64, kDt);  // unit 2^-18
  const auto drive = to_drive(lattice, {0, 0, -9.0}, 0.3);
  ASSERT_TRUE(drive);
  // 9 m/s^2 / 30^2 = 0.01 m per frame^2 = 0.01 * 2^18 units, times 64.
  EXPECT_EQ(drive->gravity[2], -std::lround(0.01 * (1 << 18) * 64));
  EXPECT_EQ(drive->damping, std::lround(0.01 * 65536));
}

TEST(ToDrive, RefusesWhatThePredictedStepCannotHold) {
  const auto lattice = *choose_lattice(1.0 / 64, 64, kDt);
  EXPECT_FALSE(to_drive(lattice, {1e12, 0, 0}, 0));
  EXPECT_FALSE(to_drive(lattice, {std::nan(""), 0, 0}, 0));
  EXPECT_FALSE(to_drive(lattice, {}, 30));
  EXPECT_FALSE(to_drive(lattice, {}, -0.1));
  EXPECT_FALSE(to_drive(lattice, {}, std::nan("")));
}

}  // namespace
}  // namespace tandem::host
