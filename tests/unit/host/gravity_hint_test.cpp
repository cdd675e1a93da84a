#include "services/host/frames/gravity_hint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tandem::host {
namespace {

using ::testing::HasSubstr;

/// Bodies whose velocities change by 1 / dt of `pull` in a frame, but for the first `others` of them.
class GravityHintTest : public ::testing::Test {
 protected:
  GravityHintTest() {
    for (std::uint8_t& alive : state.alive()) alive = 1;
  }
  std::string fall(int frames, double pull, Slot others = 0) {
    std::string said;
    for (int frame = 0; frame < frames; ++frame) {
      for (Slot s = others; s < state.capacity(); ++s)
        state.v(1)[s] += static_cast<std::int32_t>(pull * lattice.dt_s * lattice.velocity_scale());
      said += hint.look(state);
    }
    return said;
  }
  Lattice lattice = *choose_lattice(0.01, 50, 1.0 / 30);
  State state{100};
  GravityHint hint{lattice, static_cast<std::int32_t>(0.01 * lattice.position_scale())};
};

TEST_F(GravityHintTest, ASimulationThatFallsAndSaysNoGravityIsToldOnce) {
  EXPECT_EQ(fall(10, -9.81), "");
  EXPECT_THAT(fall(20, -9.81), HasSubstr("by (0, -9.81, 0), but the simulation says that its gravity is 0"));
  EXPECT_EQ(fall(100, -9.81), "");
}

TEST_F(GravityHintTest, WhatIsNoGravityIsNotTold) {
  EXPECT_EQ(fall(100, 0), "") << "free flight";
  EXPECT_EQ(fall(100, -0.01), "") << "less than a threshold in a second";
  EXPECT_EQ(fall(100, -9.81, 50), "") << "half of the bodies";
  for (int i = 0; i < 50; ++i) EXPECT_EQ(fall(1, i % 2 == 0 ? 9 : -9), "") << "to and fro";
}

TEST_F(GravityHintTest, AFewBodiesThatRestDoNotHideIt) { EXPECT_NE(fall(30, -9.81, 9), ""); }

}  // namespace
}  // namespace tandem::host
