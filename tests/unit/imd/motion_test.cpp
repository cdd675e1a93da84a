#include "services/adapters/imd/motion.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tandem::imd {
namespace {

using testing::ElementsAre;

constexpr double kFrame = 0.1;

Topology two_atoms() {
  Topology topology;
  topology.kinds.push_back({.name = "a"});
  topology.kind_of = {0, 0};
  topology.box = {10, 10, 10};
  return topology;
}

/// Atom 0 at x, atom 1 at rest, in frame `number` of an engine in which atom 0 moves by `step`.
Newest at(std::uint64_t number, float x, float step) {
  const auto positions = [](float first) { return std::vector<float>{first, 0, 0, 5, 5, 5}; };
  return {.number = number,
          .now = positions(x),
          .before = positions(x - step),
          .earlier = positions(x - 2 * step),
          .velocities = {},
          .moment = std::nullopt,
          .box = std::nullopt};
}

TEST(ImdMotion, DifferencesAreTheMotionFromFrameToFrame) {
  Motion motion(two_atoms(), {.scale = 2, .frame_s = kFrame});
  motion.show(at(1, 1, 0.25F));
  EXPECT_EQ(motion.columns().position[0][0], 2);
  motion.show(at(2, 1.25F, 0.25F));
  EXPECT_NEAR(motion.columns().velocity[0][0], 0.25 * 2 / kFrame, 1e-5);
  motion.hold();
  EXPECT_EQ(motion.columns().velocity[0][0], 0);
  EXPECT_EQ(motion.columns().position[0][0], 2.5);
}

TEST(ImdMotion, SeveralFramesOfTheEngineMakeOneOfTheServer) {
  Motion motion(two_atoms(), {.scale = 1, .frame_s = kFrame});
  float x = 0;
  for (std::uint64_t number = 1; number < 100; number += 4, x += 0.4F) motion.show(at(number, x, 0.1F));
  EXPECT_NEAR(motion.columns().velocity[0][0], 0.4 / kFrame, 1e-3);
}

TEST(ImdMotion, TheEnginesOwnVelocitiesAreOfItsTime) {
  Motion motion(two_atoms(), {.scale = 1, .frame_s = kFrame});
  for (int i = 1; i < 5; ++i) {
    Newest newest = at(static_cast<std::uint64_t>(i), 0.03F * static_cast<float>(i), 99);
    newest.velocities = {6, 0, 0, 0, 0, 0};
    newest.moment = Moment{.dt = 0.001, .time = 0.005 * i, .step = 5 * i};
    motion.show(newest);
  }
  EXPECT_NEAR(motion.columns().velocity[0][0], 6 * 0.005 / kFrame, 1e-5);
}

TEST(ImdMotion, ACrossingOfTheBoxIsAnotherBody) {
  Motion motion(two_atoms(), {.scale = 1, .frame_s = kFrame});
  motion.show(at(1, 9.75F, 0.5F));
  motion.show(at(2, 0.25F, -9.5F));
  EXPECT_THAT(motion.columns().alive, ElementsAre(2, 1));
  EXPECT_EQ(motion.columns().velocity[0][0], 0);
}

TEST(ImdMotion, PushesHitWhatIsWithin) {
  Motion motion(two_atoms(), {.scale = 2, .frame_s = kFrame});
  motion.show(at(1, 1, 0));
  EXPECT_THAT(motion.within({2, 0, 0}, 0.5), ElementsAre(0));
  EXPECT_THAT(motion.within({10, 10, 10}, 0.5), ElementsAre(1));
  EXPECT_TRUE(motion.within({50, 0, 0}, 1).empty());
}

}  // namespace
}  // namespace tandem::imd
