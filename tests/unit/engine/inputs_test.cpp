#include <limits>

#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

using Effect = Classification::Effect;

TEST(Inputs, GravityIsScheduledWithTheDriveItWillSet) {
  EngineWorld world = empty_world(1);
  world.damping_per_s = 0.25F;
  const auto s = make(world);
  const Classification c = s->classify(gravity_input(1, -2, 3));
  EXPECT_EQ(c.effect, Effect::kScheduled);
  EXPECT_EQ(c.gravity, (Vec3{1, -2, 3}));
  EXPECT_EQ(c.damping_per_s, 0.25);
  EXPECT_EQ(s->gravity(), (Vec3{0, 0, 0})) << "classify() applies nothing";
}

TEST(Inputs, TheLastGravityOfAFrameWins) {
  EngineWorld world = empty_world(1);
  world.start = {{{0, 0, 0}, {}, 0}};
  const auto s = make(world);
  s->apply(gravity_input(9, 9, 9));
  s->apply(gravity_input(0, -3, 0));
  EXPECT_EQ(s->gravity(), (Vec3{0, -3, 0}));
  s->step();
  EXPECT_NEAR(velocity(*s, 0)[1], -0.1, 1e-6);
  EXPECT_EQ(velocity(*s, 0)[0], 0);
}

TEST(Inputs, APushMovesOnlyBodiesWithinItsRadiusInTheNextStep) {
  EngineWorld world = empty_world(2);
  world.start = {{{0, 0, 0}, {}, 0}, {{5, 0, 0}, {}, 0}};
  const auto s = make(world);
  const Input push = push_input({0, 0, 0}, 2, {0, 3, 0});
  EXPECT_EQ(s->classify(push).effect, Effect::kImmediate);
  s->apply(push);
  EXPECT_EQ(velocity(*s, 0)[1], 0);
  s->step();
  EXPECT_NEAR(velocity(*s, 0)[1], 3, 1e-6);
  EXPECT_NEAR(position(*s, 0)[1], 0.1, 1e-6);
  EXPECT_EQ(velocity(*s, 1)[1], 0);
  s->step();
  EXPECT_NEAR(velocity(*s, 0)[1], 3, 1e-6) << "a push acts once";
}

TEST(Inputs, WhatIsNotFiniteOrHugeOrMalformedIsRefusedWithAReason) {
  const auto s = make(empty_world(1));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  std::vector<Input> bad;
  for (const double v : {nan, inf, -inf, 1e300, 1e30, 1e5}) {
    bad.push_back(gravity_input(0, v, 0));
    bad.push_back(push_input({v * 1e3, 0, 0}, 1, {0, 1, 0}));
    bad.push_back(push_input({0, 0, 0}, v * 1e3, {0, 1, 0}));
    bad.push_back(push_input({0, 0, 0}, 1, {0, 0, v}));
  }
  bad.push_back(push_input({0, 0, 0}, 0, {0, 1, 0}));
  bad.push_back(push_input({0, 0, 0}, -1, {0, 1, 0}));
  bad.push_back({1, {0, 1}, {}});
  bad.push_back({1, {0, 1, 2, 3}, {}});
  bad.push_back({2, {0, 1, 2}, {}});
  bad.push_back({1, {0, 1, 2}, {std::byte{1}}});
  bad.push_back({16, {}, {std::byte{1}}});
  bad.push_back({0, {}, {}});
  bad.push_back({77, {0, 1, 2}, {}});
  for (const Input& input : bad) {
    const Classification c = s->classify(input);
    EXPECT_EQ(c.effect, Effect::kRefused) << "kind " << input.kind;
    EXPECT_FALSE(c.reason.empty());
  }
}

TEST(Inputs, AWorldWithAValueOutOfRangeIsRefusedAtTheStart) {
  const auto refused = [](auto change) {
    EngineWorld world = empty_world(4);
    change(world);
    return !make_particles(world, 1).has_value();
  };
  EXPECT_FALSE(refused([](EngineWorld&) {}));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.capacity = 0; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.capacity = (1U << 22U) + 1; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.dt_s = 0; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.substeps = 0; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.damping_per_s = 30; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.types.clear(); }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.types[0].mass = 0; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.types[0].radius = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.planes = {{{0, 2, 0}, 0}}; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.boxes = {{{0, 0, 0}, {1, 0, 1}, {}}}; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.pair.spring = -1; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.start = {{{500, 0, 0}, {}, 0}}; }));
  EXPECT_TRUE(refused([](EngineWorld& w) { w.emitters = {{{0, 0, 0}, {500, 0, 0}, {}, 1, 0}}; }));
  EXPECT_FALSE(make_particles(empty_world(4), 0).has_value());
  EXPECT_FALSE(make_particles(empty_world(4), 65).has_value());
}

}  // namespace
}  // namespace tandem::engine
