// What the predictor `rigid` makes of worlds that no engine would leave alone, in which nobody corrects it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/core/rigid_world.hpp"

namespace tandem::of_rigid {
namespace {

double fastest(const State& state) {
  double most = 0;
  for (Slot s = 0; s < state.capacity(); ++s)
    for (std::size_t i = 0; i < 3; ++i) most = std::max(most, std::abs(state.v(i)[s] / 64.0));
  return most;
}

// Two bodies of each kind that gravity presses into a corner of the room, through each other and through its
// walls.
TEST(Rigid, TwoBodiesInACornerStayInTheRoomAndComeToRest) {
  constexpr std::uint64_t kSeed = 51;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const Vec3i into_corner{-20000, -20000, -20000};
  for (const TypeId type : {kCube, kBall, kCapsule, kBoard}) {
    const auto predictor = rigid(2, room());
    State state = make_state(2);
    for (Slot s = 0; s < 2; ++s) {
      const auto far = static_cast<std::int32_t>(s) * kHalf / 2;
      state.spawn(s, 0, type, {{-7 * kHalf + far, kHalf + far, -7 * kHalf + far}, {}, some_turn(random), {}});
    }
    for (int frame = 0; frame < 1000; ++frame) {
      predictor->step(state, state, input_of(into_corner));
      ASSERT_LT(fastest(state), 2 * kHalf) << "type " << type << ", frame " << frame;
    }
    const State rested = state;
    for (int frame = 0; frame < 2000; ++frame) predictor->step(state, state, input_of(into_corner));
    for (Slot s = 0; s < 2; ++s) {
      EXPECT_LT(moved(state, rested, s), 2000 * 0.1 * kThreshold) << "type " << type;
      for (const std::size_t axis : {0U, 2U})
        EXPECT_GT(state.p(axis)[s], -8 * kHalf + kHalf / 4 - kThreshold) << "type " << type;
      EXPECT_GT(state.p(1)[s], kHalf / 4 - kThreshold) << "type " << type;
    }
  }
}

// The floor runs through their middle, a small box of the geometry is within a body.
TEST(Rigid, AWallThroughABodyPushesItOutWithoutAnExplosion) {
  RigidConstants constants = room();
  constants.contact.boxes = constants_of(1).boxes;
  constants.contact.boxes[0].centre = {6 * kHalf, 10 * kHalf, 0};
  constants.contact.boxes[0].half = {kHalf / 8, kHalf / 8, kHalf / 8};
  for (const bool within : {false, true}) {
    for (const TypeId type : {kCube, kBall, kCapsule, kBoard}) {
      const auto predictor = rigid(1, constants);
      State state = make_state(1);
      if (within) {
        state.spawn(0, 0, type, {{6 * kHalf, 10 * kHalf, 0}, {}});
      } else {
        state.spawn(0, 0, type, {{0, 0, 0}, {}});
      }
      for (int frame = 0; frame < 500; ++frame) {
        predictor->step(state, state, input_of(kGravity));
        ASSERT_LT(fastest(state), 4 * kHalf) << "type " << type << ", frame " << frame;
      }
      EXPECT_GT(state.p(1)[0], kHalf / 4 - kThreshold) << "type " << type;
      EXPECT_LT(state.p(1)[0], 12 * kHalf) << "type " << type;
    }
  }
}

TEST(Rigid, WithoutGravityABlockOfBodiesThatMeetGainsNoEnergy) {
  constexpr std::uint64_t kSeed = 52;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  for (const bool mixed : {false, true}) {
    const auto predictor = rigid(100, room());
    State state = block(100, mixed);
    for (Slot s = 0; s < 100; ++s)
      for (std::size_t i = 0; i < 3; ++i) state.v(i)[s] = vector_within(random, 64 * kThreshold)[i];
    const auto motion = [&state] {
      double sum = 0;
      for (Slot s = 0; s < state.capacity(); ++s)
        for (std::size_t i = 0; i < 3; ++i) sum += std::pow(state.v(i)[s] / 64.0 / kThreshold, 2) / 2;
      return sum;
    };
    double least = motion();
    const double start = least;
    for (int frame = 0; frame < 600; ++frame) {
      predictor->step(state, state, input_of({}));
      ASSERT_LT(motion(), least + 0.01 * start) << "frame " << frame;
      least = std::min(least, motion());
    }
    EXPECT_LT(least, start / 2);
  }
}

}  // namespace
}  // namespace tandem::of_rigid
