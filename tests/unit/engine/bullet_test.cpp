#include "services/engines/bullet/bullet.hpp"
#include "services/engines/common/check.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <random>

#include "services/engines/bullet/check.hpp"
#include "services/engines/bullet/inputs.hpp"
#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

using ::testing::HasSubstr;

constexpr float kHalf = 0.2F;  // of a box's edge, m

Shape box(float x, float y, float z) { return {Shape::Kind::kBox, 0, {x, y, z}}; }
Shape ball(float radius) { return {Shape::Kind::kSphere, radius, {}}; }

/// A floor at y = 0 and one type, a cube; no bodies.
RigidWorld floor_world(std::uint32_t capacity, const Shape& shape = box(kHalf, kHalf, kHalf)) {
  RigidWorld rigid;
  rigid.world = empty_world(capacity);
  rigid.world.dt_s = 1.0F / 60;
  rigid.world.substeps = 2;
  rigid.world.gravity = {0, -9.81F, 0};
  rigid.world.low = {-50, -5, -50};
  rigid.world.high = {50, 50, 50};
  rigid.world.planes = {{{0, 1, 0}, 0}};
  rigid.world.types = {{static_cast<float>(inner_radius(shape)), 1}};
  rigid.shapes = {shape};
  return rigid;
}

/// Loose layers of bodies above the floor, five by five.
RigidWorld heap_world(std::uint32_t bodies) {
  RigidWorld rigid = floor_world(bodies);
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const auto at = [](std::uint32_t n) { return 0.45F * static_cast<float>(n); };
    rigid.world.start.push_back({{at(i % 5) + 0.05F * at(i / 25), 0.3F + at(i / 25), at(i / 5 % 5)}, {}, 0});
    rigid.orientation.push_back({0, 0, 0.6F, 0.8F});
  }
  return rigid;
}

std::unique_ptr<Simulation> make(const RigidWorld& world) {
  auto made = make_bullet(world);
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

void run(Simulation& s, int frames) {
  for (int i = 0; i < frames; ++i) s.step();
}

Vec3 angular_velocity(const Simulation& s, std::uint32_t slot) {
  const auto& w = s.bodies().angular_velocity;
  return {static_cast<double>(w[0][slot]), static_cast<double>(w[1][slot]), static_cast<double>(w[2][slot])};
}

/// As same_bodies(), with what turns.
::testing::AssertionResult same_motion(const Simulation& a, const Simulation& b) {
  const Bodies x = a.bodies();
  const Bodies y = b.bodies();
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::uint32_t slot = 0; slot < a.capacity(); ++slot) {
      if (x.alive[slot] == 0) continue;
      if (x.orientation[i][slot] != y.orientation[i][slot] ||
          (i < 3 && x.angular_velocity[i][slot] != y.angular_velocity[i][slot])) {
        return ::testing::AssertionFailure() << "slot " << slot << " is turned differently";
      }
    }
  }
  return same_bodies(a, b);
}

TEST(Bullet, ABodyFallsAndRestsWithVelocitiesOfExactlyZero) {
  RigidWorld world = floor_world(1);
  world.world.start = {{{0, 2, 0}, {}, 0}};
  world.orientation = {{0.6F, 0, 0, 0.8F}};
  const auto s = make(world);
  s->step();
  EXPECT_NEAR(velocity(*s, 0)[1], -9.81 / 60, 1e-5);
  run(*s, 400);
  EXPECT_NEAR(position(*s, 0)[1], static_cast<double>(kHalf), 0.01);
  EXPECT_EQ(velocity(*s, 0), (Vec3{0, 0, 0}));
  EXPECT_EQ(angular_velocity(*s, 0), (Vec3{0, 0, 0}));
  EXPECT_EQ(s->colliding(), 1U);
  EXPECT_EQ(s->mishaps(), Mishaps{});
}

TEST(Bullet, OrientationsAreUnitQuaternionsThatTurnAsTheAngularVelocitySays) {
  RigidWorld world = floor_world(1);
  world.world.gravity = {0, 0, 0};
  world.world.start = {{{0, 20, 0}, {}, 0}};
  const auto s = make(world);
  s->apply(to_input(Remove{{0, 20, 0}, 1}));
  s->apply(to_input(Spawn{.position = {0, 20, 0}, .angular_velocity = {0, 6, 0}}));
  s->step();
  const auto& q = s->bodies().orientation;
  EXPECT_NEAR(q[1][0], std::sin(0.05), 1e-4) << "half of 6 rad/s over 1/60 s, about y";
  EXPECT_NEAR(q[3][0], std::cos(0.05), 1e-4);
  EXPECT_NEAR(angular_velocity(*s, 0)[1], 6, 1e-3);
}

TEST(Bullet, EveryShapeRestsOnItsLowestPoint) {
  const std::vector<std::pair<Shape, double>> cases{
      {ball(0.3F), 0.3},
      {box(0.4F, 0.1F, 0.3F), 0.1},
      {{Shape::Kind::kCylinder, 0, {0.3F, 0.2F}}, 0.2},
      {{Shape::Kind::kHull,
        0,
        {0.3F, -0.2F, 0.3F, -0.3F, -0.2F, 0.3F, 0.3F, -0.2F, -0.3F, -0.3F, -0.2F, -0.3F, 0, 0.4F, 0}},
       0.2},
      {{Shape::Kind::kCapsule, 0, {0.2F, 0.3F}}, 0.5},
  };
  for (const auto& [shape, height] : cases) {
    RigidWorld world = floor_world(1, shape);
    world.world.start = {{{0, static_cast<float>(height) + 0.05F, 0}, {}, 0}};
    const auto s = make(world);
    run(*s, 60);
    EXPECT_NEAR(position(*s, 0)[1], height, 0.02) << "kind " << static_cast<int>(shape.kind);
  }
}

TEST(Bullet, AStackOfBoxesStands) {
  RigidWorld world = floor_world(10);
  for (int i = 0; i < 10; ++i)
    world.world.start.push_back({{0, kHalf + 2 * kHalf * static_cast<float>(i), 0}, {}, 0});
  const auto s = make(world);
  run(*s, 600);
  for (std::uint32_t slot = 0; slot < 10; ++slot) {
    EXPECT_NEAR(position(*s, slot)[0], 0, 0.05);
    EXPECT_NEAR(position(*s, slot)[1], 0.2 + 0.4 * slot, 0.05);
    EXPECT_EQ(velocity(*s, slot), (Vec3{0, 0, 0})) << "asleep";
  }
}

TEST(Bullet, TheSceneHoldsBodiesAsItsShapesSay) {
  RigidWorld world = floor_world(2, ball(0.2F));
  world.world.boxes = {{{0, 1, 0}, {1, 1, 1}, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}}};
  world.world.balls = {{{10, 0, 0}, 3}};
  world.world.start = {{{0, 2.5F, 0}, {}, 0}, {{10, 3.5F, 0}, {}, 0}};
  const auto s = make(world);
  run(*s, 30);
  EXPECT_NEAR(position(*s, 0)[1], 2.2, 0.02);
  EXPECT_NEAR(position(*s, 1)[1], 3.2, 0.02);
}

std::vector<Input> inputs_of(int frame) {
  switch (frame) {
    case 40:
      return {push_input({0.5, 0.5, 0.5}, 1.0, {3, 4, 0})};
    case 60:
      return {to_input(Remove{{1, 0.5F, 1}, 0.5F}),
              to_input(Spawn{.position = {1, 4, 1}, .velocity = {0, -5, 0}, .angular_velocity = {9, 0, 1}})};
    case 80:
      return {gravity_input(4, -8, 0)};
    default:
      return {};
  }
}

TEST(Bullet, TheSameInputsGiveTheSameBits) {
  const auto a = make(heap_world(150));
  const auto b = make(heap_world(150));
  for (int frame = 0; frame < 200; ++frame) {
    for (const Input& input : inputs_of(frame)) {
      ASSERT_NE(a->classify(input).effect, Classification::Effect::kRefused) << a->classify(input).reason;
      a->apply(input);
      b->apply(input);
    }
    a->step();
    b->step();
    ASSERT_TRUE(same_motion(*a, *b)) << "frame " << frame;
    ASSERT_EQ(a->events().size(), b->events().size());
  }
}

TEST(Bullet, APushOffTheMiddleTurnsABody) {
  RigidWorld world = floor_world(2);
  world.world.gravity = {0, 0, 0};
  world.world.start = {{{0, 10, 0}, {}, 0}, {{9, 10, 0}, {}, 0}};
  const auto s = make(world);
  s->apply(push_input({0, 10 + 0.2, -0.5}, 1, {0, 0, 2}));
  s->step();
  EXPECT_NEAR(velocity(*s, 0)[2], 2, 1e-4);
  // Inertia of a cube of mass 1: (2 * 0.2)^2 / 6; lever 0.2, impulse 2.
  EXPECT_NEAR(angular_velocity(*s, 0)[0], 0.2 * 2 / (0.16 / 6), 0.2);
  EXPECT_EQ(velocity(*s, 1), (Vec3{0, 0, 0})) << "out of the radius";
  EXPECT_EQ(angular_velocity(*s, 1), (Vec3{0, 0, 0}));
}

TEST(Bullet, APushCostsItsSpeedTimesTheShareOfTheBodiesThatItReaches) {
  RigidWorld world = heap_world(200);
  world.world.push_budget = 3;
  world.world.max_push = 30;
  const auto s = make(world);
  EXPECT_EQ(s->input_budget().per_second, 3);
  EXPECT_EQ(s->input_budget().most, 30) << "one push of all bodies";
  const auto cost = [&](double radius, Vec3 change) {
    return s->classify(push_input({0, 0, 0}, radius, change)).cost;
  };
  EXPECT_DOUBLE_EQ(cost(1000, {0, 30, 0}), 30);
  EXPECT_DOUBLE_EQ(cost(1000, {3, 0, 4}), 5);
  EXPECT_DOUBLE_EQ(cost(0.01, {0, 30, 0}), 30 * kLeastShare);
}

TEST(Bullet, APushWakesWhatSleeps) {
  const auto s = make(heap_world(50));
  run(*s, 900);
  ASSERT_EQ(rms_speed(*s), 0);
  s->apply(push_input({0.9, 0.3, 0.9}, 1, {0, 3, 0}));
  s->step();
  EXPECT_GT(rms_speed(*s), 0.1);
}

TEST(Bullet, GravityWakesAllAndIsScheduled) {
  const auto s = make(heap_world(50));
  run(*s, 900);
  const Classification c = s->classify(gravity_input(0, 5, 0));
  EXPECT_EQ(c.effect, Classification::Effect::kScheduled);
  EXPECT_EQ(c.gravity, (Vec3{0, 5, 0}));
  s->apply(gravity_input(0, 5, 0));
  EXPECT_EQ(s->gravity(), (Vec3{0, 5, 0}));
  run(*s, 10);
  for (std::uint32_t slot = 0; slot < 50; ++slot) EXPECT_GT(velocity(*s, slot)[1], 0.3);
}

TEST(Bullet, BodiesComeAndGoByInputAndWhatRestedOnThemFalls) {
  RigidWorld world = floor_world(3);
  world.world.start = {{{0, 0.2F, 0}, {}, 0}, {{0, 0.6F, 0}, {}, 0}};
  const auto s = make(world);
  run(*s, 400);
  ASSERT_EQ(velocity(*s, 1), (Vec3{0, 0, 0})) << "asleep on the other";
  s->apply(to_input(Remove{{0, 0.2F, 0}, 0.1F}));
  s->step();
  ASSERT_EQ(s->events().size(), 1U);
  EXPECT_EQ(s->events()[0].kind, Event::Kind::kDespawned);
  EXPECT_EQ(s->events()[0].slot, 0U);
  run(*s, 60);
  EXPECT_NEAR(position(*s, 1)[1], 0.2, 0.02);
  for (int i = 0; i < 3; ++i) s->apply(to_input(Spawn{.position = {5, 1 + static_cast<float>(i), 5}}));
  s->step();
  ASSERT_EQ(s->events().size(), 2U) << "the third finds no free slot";
  EXPECT_EQ(s->events()[0].kind, Event::Kind::kSpawned);
  EXPECT_EQ(s->events()[0].slot, 0U);
  EXPECT_EQ(s->events()[1].slot, 2U);
}

TEST(Bullet, InputsThatAreNoneAreRefusedWithAReason) {
  const auto s = make(floor_world(1));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Input cut = to_input(Spawn{});
  cut.bytes.pop_back();
  Input other = to_input(Remove{});
  other.bytes[0] = std::byte{3};
  Input filled = to_input(Remove{{}, 1});
  filled.bytes[1] = std::byte{1};
  Input values = to_input(Remove{{}, 1});
  values.values = {1};
  const std::vector<Input> bad{cut,
                               other,
                               filled,
                               values,
                               {16, {}, {}},
                               {77, {}, {}},
                               gravity_input(0, 1e9, 0),
                               push_input({0, 0, 0}, -1, {0, 0, 0}),
                               to_input(Spawn{.type = 1}),
                               to_input(Spawn{.position = {0, 60, 0}}),
                               to_input(Spawn{.position = {nan, 0, 0}}),
                               to_input(Spawn{.velocity = {0, nan, 0}}),
                               to_input(Spawn{.velocity = {0, 1e9F, 0}}),
                               to_input(Spawn{.orientation = {0, 0, 0, 0}}),
                               to_input(Spawn{.orientation = {0, 0, 0, 1.1F}}),
                               to_input(Spawn{.orientation = {0, 0, 0, nan}}),
                               to_input(Spawn{.angular_velocity = {0, 121, 0}}),
                               to_input(Spawn{.angular_velocity = {nan, 0, 0}}),
                               to_input(Remove{{}, 0}),
                               to_input(Remove{{}, nan}),
                               to_input(Remove{{nan, 0, 0}, 1})};
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const Classification c = s->classify(bad[i]);
    EXPECT_EQ(c.effect, Classification::Effect::kRefused) << "input " << i;
    EXPECT_FALSE(c.reason.empty()) << "input " << i;
  }
}

TEST(Bullet, ACheckpointGoesOnValidlyAndTwoLoadsAlike) {
  const auto a = make(heap_world(100));
  for (int frame = 0; frame < 70; ++frame) {
    for (const Input& input : inputs_of(frame)) a->apply(input);
    a->step();
  }
  a->apply(push_input({0.5, 0.5, 0.5}, 1, {0, 5, 0}));
  a->apply(gravity_input(0, -5, 0));
  std::vector<std::byte> saved;
  a->save(saved);
  const auto b = make(heap_world(100));
  const auto c = make(heap_world(100));
  run(*c, 30);
  ASSERT_TRUE(b->load(saved) && c->load(saved));
  EXPECT_TRUE(same_motion(*a, *b)) << "right after";
  EXPECT_EQ(b->gravity(), (Vec3{0, -5, 0}));
  std::vector<std::byte> again;
  b->save(again);
  EXPECT_EQ(saved, again);
  for (int frame = 0; frame < 300; ++frame) {
    a->step();
    b->step();
    c->step();
    ASSERT_TRUE(same_motion(*b, *c)) << "frame " << frame;
    if (frame == 0) {
      for (std::uint32_t slot = 0; slot < 100; ++slot) {
        for (std::size_t i = 0; i < 3; ++i)
          EXPECT_NEAR(position(*a, slot)[i], position(*b, slot)[i], 0.02) << slot;
      }
    }
  }
  EXPECT_EQ(b->mishaps(), Mishaps{});
}

TEST(Bullet, ACheckpointKeepsSleepersAsleep) {
  const auto a = make(heap_world(50));
  run(*a, 900);
  ASSERT_EQ(rms_speed(*a), 0);
  std::vector<std::byte> saved;
  a->save(saved);
  const auto b = make(heap_world(50));
  ASSERT_TRUE(b->load(saved));
  for (int frame = 0; frame < 60; ++frame) {
    b->step();
    ASSERT_TRUE(same_bodies(*a, *b)) << frame;
  }
}

TEST(Bullet, DamagedAndForeignCheckpointsAreRefusedAndChangeNothing) {
  const auto a = make(heap_world(30));
  run(*a, 20);
  std::vector<std::byte> saved;
  a->save(saved);
  const auto b = make(heap_world(30));
  RigidWorld other = heap_world(30);
  other.friction = 0.4F;
  EXPECT_FALSE(make(other)->load(saved));
  std::vector<std::byte> damaged = saved;
  damaged[100] ^= std::byte{1};
  EXPECT_FALSE(b->load(damaged));
  EXPECT_FALSE(b->load(std::span(saved).first(saved.size() - 1)));
  EXPECT_FALSE(b->load({}));
  EXPECT_TRUE(same_motion(*b, *make(heap_world(30))));
}

TEST(Bullet, ABodyThatTurnsTooFastIsSlowedDownAndCounted) {
  RigidWorld world = floor_world(1);
  world.world.gravity = {0, 0, 0};
  world.world.start = {{{0, 10, 0}, {}, 0}};
  const auto s = make(world);
  for (int i = 0; i < 10; ++i) s->apply(push_input({0, 10.2, -0.5}, 1, {0, 0, 20}));
  s->step();
  const Vec3 w = angular_velocity(*s, 0);
  EXPECT_NEAR(std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), 120, 0.1);
  EXPECT_GE(s->mishaps().clamped, 1U);
  EXPECT_EQ(s->mishaps().removed, 0U);
}

TEST(Bullet, WhatLeavesTheWorldIsRemovedAndTheRestGoesOn) {
  RigidWorld world = heap_world(60);
  const auto s = make(world);
  run(*s, 100);
  for (int i = 0; i < 5; ++i) s->apply(push_input({0, 0.2, 0}, 0.8, {900, 0, 0}));
  run(*s, 30);
  EXPECT_GE(s->mishaps().removed, 1U);
  const auto alive = static_cast<std::uint64_t>(
      std::count(s->bodies().alive.begin(), s->bodies().alive.end(), std::uint8_t{1}));
  EXPECT_EQ(alive + s->mishaps().removed, 60U);
  EXPECT_GT(alive, 0U);
  run(*s, 100);
}

TEST(Bullet, BodiesPressedIntoOneAnotherDoNotEndTheSession) {
  RigidWorld world = floor_world(200);
  for (int i = 0; i < 200; ++i) world.world.start.push_back({{0, 0.3F, 0}, {}, 0});
  const auto s = make(world);
  for (int frame = 0; frame < 300; ++frame) {
    s->step();
    for (std::uint32_t slot = 0; slot < 200; ++slot) {
      if (s->bodies().alive[slot] == 0) continue;
      ASSERT_TRUE(std::isfinite(position(*s, slot)[1]));
      const Vec3 w = angular_velocity(*s, slot);
      ASSERT_LE(std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) / 60, kMaxTurn);
    }
  }
}

TEST(Bullet, InputsAtTheirLimitsLeaveBodiesThatASessionMayShow) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const auto within = [&random](double limit) {
    return limit * (std::ldexp(static_cast<double>(random() >> 11U), -52) - 1);
  };
  RigidWorld world = heap_world(80);
  world.restitution = 1;
  const EngineWorld& limits = world.world;
  const auto s = make(world);
  const MotionLimits allowed = motion_limits(limits);
  const auto push = limits.max_push / std::sqrt(3.0);
  const auto gravity = limits.max_gravity / std::sqrt(3.0);
  const auto act = [&](const Input& input) {
    const Classification c = s->classify(input);
    ASSERT_NE(c.effect, Classification::Effect::kRefused) << c.reason;
    s->apply(input);
  };
  for (int frame = 0; frame < 400; ++frame) {
    const Vec3 centre{within(2), 1 + within(1), within(2)};
    const Vec3f place{static_cast<float>(centre[0]), static_cast<float>(centre[1]),
                      static_cast<float>(centre[2])};
    if (frame % 3 == 0) act(push_input(centre, 2, {within(push), within(push), within(push)}));
    if (frame % 50 == 0) act(gravity_input(within(gravity), within(gravity), within(gravity)));
    // Bodies inside of others, as fast as they may be.
    for (int i = 0; i < 3; ++i)
      act(to_input(Spawn{.position = place,
                         .velocity = {static_cast<float>(within(push)), 0, static_cast<float>(push)},
                         .angular_velocity = {0, 0.999F * allowed.turn_per_s, 0}}));
    s->step();
    for (std::uint32_t slot = 0; slot < limits.capacity; ++slot) {
      if (s->bodies().alive[slot] == 0) continue;
      Motion motion;
      for (std::size_t i = 0; i < 3; ++i) {
        motion.position[i] = s->bodies().position[i][slot];
        motion.velocity[i] = s->bodies().velocity[i][slot];
        motion.angular_velocity[i] = s->bodies().angular_velocity[i][slot];
      }
      for (std::size_t i = 0; i < 4; ++i) motion.orientation[i] = s->bodies().orientation[i][slot];
      ASSERT_NE(mend(motion, allowed), Condition::kLost) << "frame " << frame << ", slot " << slot;
    }
  }
  EXPECT_GT(s->mishaps().removed, 0U);
}

TEST(Bullet, AWorldThatBreaksARuleIsRefusedWithTheRule) {
  const auto refusal = [](const auto& change) {
    RigidWorld world = floor_world(2);
    world.world.start = {{{0, 1, 0}, {}, 0}};
    change(world);
    const auto made = make_bullet(world);
    return made ? "accepted" : made.error().message;
  };
  EXPECT_EQ(refusal([](RigidWorld&) {}), "accepted");
  EXPECT_THAT(refusal([](RigidWorld& w) { w.shapes.clear(); }), HasSubstr("every type needs a shape"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.shapes[0] = box(0, 1, 1); }), HasSubstr("half sizes above 0"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.shapes[0] = ball(0); }), HasSubstr("radius above 0"));
  EXPECT_THAT(refusal([](RigidWorld& w) {
                w.shapes[0] = {Shape::Kind::kHull, 0, {1, 1, 1}};
              }),
              HasSubstr("4 to 256 points"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.friction = -1; }), HasSubstr("friction"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.restitution = 2; }), HasSubstr("restitution"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.orientation = {{0, 0, 0, 0.9F}}; }), HasSubstr("norm 1"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.orientation.resize(2); }), HasSubstr("all bodies"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.spin = {{0, 0, 1e6F}}; }), HasSubstr("turns too fast"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.cruise = Cruise{}; }), HasSubstr("every slot"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.world.emitters.resize(1); }), HasSubstr("particles"));
  EXPECT_THAT(refusal([](RigidWorld& w) { w.world.dt_s = 0; }), HasSubstr("dt"));
}

TEST(Bullet, ABodyThatCruisesRegainsItsSpeedAndComesBackIntoItsBall) {
  const Cruise cruise{.radius = 10, .acceleration = 5, .return_acceleration = 10, .speed = {}};
  const auto next = [&](const Vec3f& at, const Vec3f& velocity) {
    return cruised(at, velocity, 4, cruise, 0.1F);
  };
  EXPECT_EQ(next({1, 0, 0}, {0, 2, 0}), (Vec3f{0, 2.5F, 0}));
  EXPECT_EQ(next({1, 0, 0}, {0, 3.75F, 0}), (Vec3f{0, 4, 0}));
  EXPECT_EQ(next({1, 0, 0}, {0, -8, 0}), (Vec3f{0, -7.5F, 0}));
  EXPECT_EQ(next({1, 0, 0}, {0, 0, 0}), (Vec3f{0, 0, 0})) << "it has no direction";
  EXPECT_EQ(next({0, 20, 0}, {1, 0, 0}), (Vec3f{1, -1, 0}));
}

}  // namespace
}  // namespace tandem::engine
