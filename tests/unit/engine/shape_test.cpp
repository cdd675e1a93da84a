#include "services/engines/common/shape.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/engines/bullet/bullet.hpp"
#include "services/engines/bullet/motion.hpp"

namespace tandem::engine {
namespace {

TEST(Shapes, KnowTheirExtents) {
  const auto radii = [](const Shape& shape) {
    EXPECT_TRUE(check(shape));
    return std::pair(bounding_radius(shape), inner_radius(shape));
  };
  EXPECT_EQ(radii({Shape::Kind::kSphere, 2, {}}), std::pair(2.0, 2.0));
  EXPECT_EQ(radii({Shape::Kind::kBox, 0, {2, 1, 2}}), std::pair(3.0, 1.0));
  EXPECT_EQ(radii({Shape::Kind::kCapsule, 0, {1, 2}}), std::pair(3.0, 1.0));
  EXPECT_EQ(radii({Shape::Kind::kCylinder, 0, {4, 3}}), std::pair(5.0, 3.0));
  EXPECT_EQ(radii({Shape::Kind::kHull, 0, {0, 3, 0, 1, -1, 1, -1, -1, 1, 0, -1, -1}}), std::pair(3.0, 1.0));
}

TEST(Shapes, WithoutASizeAreRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Shape> bad{{Shape::Kind::kSphere, 0, {}},
                               {Shape::Kind::kSphere, nan, {}},
                               {Shape::Kind::kSphere, 1, {1}},
                               {Shape::Kind::kBox, 0, {1, 1}},
                               {Shape::Kind::kBox, 0, {1, 0, 1}},
                               {Shape::Kind::kBox, 0, {1, nan, 1}},
                               {Shape::Kind::kCapsule, 0, {0, 1}},
                               {Shape::Kind::kCapsule, 0, {1, -1}},
                               {Shape::Kind::kCylinder, 0, {1, 0}},
                               {Shape::Kind::kHull, 0, {1, 1, 1}},
                               {Shape::Kind::kHull, 0, std::vector<float>(13, 1)},
                               {Shape::Kind::kHull, 0, std::vector<float>(3 * 257, 1)},
                               {Shape::Kind::kHull, 0, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}},
                               {Shape::Kind::kHull, 0, {nan, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 1}}};
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const auto checked = check(bad[i]);
    EXPECT_FALSE(checked) << "shape " << i;
  }
}

TEST(Shapes, HaveTheNamesOfTheProtocol) {
  EXPECT_EQ(shape_kind("sphere").value(), Shape::Kind::kSphere);
  EXPECT_EQ(shape_kind("hull").value(), Shape::Kind::kHull);
  EXPECT_FALSE(shape_kind("ball"));
}

TEST(Motions, WhatIsNoNumberNoTurnOrOutsideIsLost) {
  const MotionLimits limits{{-1, -1, -1}, {1, 1, 1}, 10};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const auto condition = [&limits](Motion motion) { return mend(motion, limits); };
  EXPECT_EQ(condition({}), Condition::kFine);
  EXPECT_EQ(condition({.position = {nan, 0, 0}}), Condition::kLost);
  EXPECT_EQ(condition({.position = {0, 1.5F, 0}}), Condition::kLost);
  EXPECT_EQ(condition({.velocity = {0, 0, inf}}), Condition::kLost);
  EXPECT_EQ(condition({.orientation = {0, 0, 0, 0}}), Condition::kLost);
  EXPECT_EQ(condition({.orientation = {0, 0, 0, 1.01F}}), Condition::kLost);
  EXPECT_EQ(condition({.orientation = {nan, 0, 0, 1}}), Condition::kLost);
  EXPECT_EQ(condition({.angular_velocity = {0, nan, 0}}), Condition::kLost);
  EXPECT_EQ(condition({.angular_velocity = {0, inf, 0}}), Condition::kLost);
}

TEST(Motions, WhatTurnsTooFastTurnsAtTheLimitAboutTheSameAxis) {
  const MotionLimits limits{{-1, -1, -1}, {1, 1, 1}, 10};
  Motion motion{.angular_velocity = {6, 0, 8}};
  EXPECT_EQ(mend(motion, limits), Condition::kFine);
  motion.angular_velocity = {3e38F, 0, -3e38F};
  EXPECT_EQ(mend(motion, limits), Condition::kClamped);
  EXPECT_NEAR(motion.angular_velocity[0], 10 / std::sqrt(2.0), 1e-4);
  EXPECT_NEAR(motion.angular_velocity[2], -10 / std::sqrt(2.0), 1e-4);
}

TEST(Bullet, IsEitherBuiltOrSaysSoInOneLine) {
  if (bullet_is_built()) return;
  const auto made = make_bullet({});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::kUnsupported);
  EXPECT_NE(made.error().message.find("libbullet-dev"), std::string::npos);
}

}  // namespace
}  // namespace tandem::engine
