// The server learns radii and friction of a predictor of hard contacts.
#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "services/host/streams/contact_control.hpp"

namespace tandem::host::of_contact_control {
namespace {

constexpr std::uint32_t kBodies = 200;
constexpr std::int32_t kThreshold = 1000;

constexpr Push kByBodiesAndWalls{{500, 0, 0}, {0, 500, 0}, {0, 0, 500}, {}};

// Every body is pushed, along x by other bodies, along y by walls and along z by friction if nothing else is
// said, and is off by `off`.
StreamParameters learned(const Vec3i& off, int frames, bool shapes = false,
                         const Push& push = kByBodiesAndWalls) {
  StreamParameters parameters;
  parameters.codec.threshold = kThreshold;
  set_first_contacts(parameters, shapes);
  ContactControl control(kBodies, parameters, shapes);
  State predicted(kBodies);
  State target(kBodies);
  for (Slot s = 0; s < kBodies; ++s) {
    predicted.spawn(s, 0, 0, {});
    target.spawn(s, 0, 0, {.p = off});
  }
  const std::vector<Push> pushes(kBodies, push);
  for (int frame = 0; frame < frames; ++frame) {
    control.observe(predicted, target, kThreshold, pushes);
    control.after_frame(parameters);
  }
  return parameters;
}

TEST(ContactControl, ErrorsAlongThePushesOfBodiesMakeRadiiLonger) {
  EXPECT_GT(learned({2 * kThreshold, 0, 0}, 60).step.contacts.radius, 500);
  EXPECT_LT(learned({-2 * kThreshold, 0, 0}, 60).step.contacts.radius, -500);
}

TEST(ContactControl, ErrorsAlongThePushesOfWallsMoveTheWalls) {
  EXPECT_GT(learned({0, 2 * kThreshold, 0}, 60).step.contacts.wall, kThreshold / 10);
  EXPECT_LT(learned({0, -2 * kThreshold, 0}, 60).step.contacts.wall, -kThreshold / 10);
}

TEST(ContactControl, ErrorsAlongFrictionMakeItStronger) {
  const std::int32_t first = learned({}, 0).step.contacts.friction;
  EXPECT_GT(learned({0, 0, 2 * kThreshold}, 60).step.contacts.friction, first * 2);
  EXPECT_LT(learned({0, 0, -2 * kThreshold}, 60).step.contacts.friction, first / 2);
}

TEST(ContactControl, OfShapesSizesAreLearnedSlowlyAndFrictionByManyCorrections) {
  const ContactParameters first = learned({}, 0, true).step.contacts;
  const ContactParameters larger = learned({2 * kThreshold, 0, 2 * kThreshold}, 60, true).step.contacts;
  EXPECT_GT(larger.radius, 500);
  EXPECT_LT(larger.radius, learned({2 * kThreshold, 0, 2 * kThreshold}, 60).step.contacts.radius);
  EXPECT_GT(larger.friction, first.friction);
  EXPECT_LT(learned({0, -2 * kThreshold, 0}, 60, true).step.contacts.wall, -kThreshold / 10);
}

TEST(ContactControl, OfShapesSizesThatSwingToAndFroSettle) {
  StreamParameters parameters;
  parameters.codec.threshold = kThreshold;
  set_first_contacts(parameters, true);
  ContactControl control(kBodies, parameters, true);
  State predicted(kBodies);
  State target(kBodies);
  const std::vector<Push> pushes(kBodies, kByBodiesAndWalls);
  std::int32_t last = 0;
  std::int32_t swing = 0;
  for (int decision = 0; decision < 12; ++decision) {
    for (Slot s = 0; s < kBodies; ++s) {
      if (decision == 0) predicted.spawn(s, 0, 0, {});
      if (decision == 0) target.spawn(s, 0, 0, {});
      target.p(0)[s] = decision % 2 == 0 ? 2 * kThreshold : -2 * kThreshold;
    }
    for (int frame = 0; frame < 15; ++frame) {
      control.observe(predicted, target, kThreshold, pushes);
      control.after_frame(parameters);
    }
    swing = std::abs(parameters.step.contacts.radius - last);
    last = parameters.step.contacts.radius;
    EXPECT_TRUE(decision > 0 || swing > 200) << swing;
  }
  EXPECT_LT(swing, 20);
}

TEST(ContactControl, ErrorsAlongThePushesOfEdgesMakeThemLessRound) {
  const Push by_edges{{}, {}, {}, {500, 0, 0}};
  const ContactParameters first = learned({}, 0, true).step.contacts;
  const ContactParameters sharper = learned({2 * kThreshold, 0, 0}, 60, true, by_edges).step.contacts;
  const ContactParameters rounder = learned({-2 * kThreshold, 0, 0}, 60, true, by_edges).step.contacts;
  EXPECT_LT(sharper.rounding, first.rounding / 2);
  EXPECT_GT(rounder.rounding, first.rounding * 2);
  EXPECT_EQ(sharper.radius, first.radius);
}

TEST(ContactControl, ErrorsWithinTheThresholdTeachNothing) {
  EXPECT_EQ(learned({kThreshold, 0, 0}, 600).step.contacts, learned({}, 0).step.contacts);
}

TEST(ContactControl, WhatIsLearnedStaysWithinItsRange) {
  for (const std::int32_t off : {-2 * kThreshold, 2 * kThreshold}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Vec3i error{};
      error[axis] = off;
      const StreamParameters parameters = learned(error, 60000);
      ASSERT_EQ(list_parameters(parameters).size(), 10U);
      EXPECT_EQ(parameters_from(list_parameters(parameters)), parameters);
    }
  }
}

}  // namespace
}  // namespace tandem::host::of_contact_control
