// Closed-form solutions of the thesis's section 3.2.1 and of the penalty contact.
#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

TEST(Physics, AFreeBodyFollowsEquation31WithDamping) {
  EngineWorld world = empty_world(1);
  world.gravity = {1, -9.81F, 0.5F};
  world.damping_per_s = 0.6F;
  world.start = {{{0, 50, 0}, {3, 0, -2}, 0}};
  const auto s = make(world);
  const double dt = s->dt_s();
  std::array<double, 3> p{0, 50, 0};
  std::array<double, 3> v{3, 0, -2};
  for (int frame = 1; frame <= 60; ++frame) {
    s->step();
    for (std::size_t i = 0; i < 3; ++i) {
      v[i] = (v[i] + dt * s->gravity()[i]) * (1 - dt * s->damping_per_s());
      p[i] += dt * v[i];
      EXPECT_NEAR(position(*s, 0)[i], p[i], 1e-4) << "frame " << frame;
      EXPECT_NEAR(velocity(*s, 0)[i], v[i], 1e-4) << "frame " << frame;
    }
  }
  EXPECT_EQ(s->colliding(), 0U);
}

TEST(Physics, SubStepsDoNotChangeFreeFlight) {
  EngineWorld world = empty_world(1);
  world.gravity = {0, -9.81F, 0};
  world.damping_per_s = 0.3F;
  world.start = {{{0, 50, 0}, {3, 0, -2}, 0}};
  const auto one = make(world);
  world.substeps = 4;
  const auto four = make(world);
  for (int frame = 0; frame < 60; ++frame) {
    one->step();
    four->step();
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(position(*one, 0)[i], position(*four, 0)[i], 1e-4);
}

TEST(Physics, ABodyRestsOnAPlaneWhereSpringBalancesWeight) {
  EngineWorld world = empty_world(1);
  world.gravity = {0, -3, 0};
  world.types = {{0.5F, 2}};
  world.wall = {100, 2, 2};
  world.planes = {{{0, 1, 0}, 1}};
  world.start = {{{0, 1.5F, 0}, {}, 0}};
  const auto s = make(world);
  for (int frame = 0; frame < 2000; ++frame) s->step();
  EXPECT_NEAR(position(*s, 0)[1], 1.5 - 2 * 3 / 100.0, 1e-4);
  EXPECT_NEAR(velocity(*s, 0)[1], 0, 1e-4);
  EXPECT_EQ(s->colliding(), 1U);
}

// A damped oscillator's coefficient of restitution, where damping pulls as well as pushes until the surfaces
// part: the linear contact ends at overlap zero, half a period after it began.
TEST(Physics, ABounceLosesTheSpeedThatALinearDamperTakes) {
  EngineWorld world = empty_world(1);
  world.dt_s = 1e-4F;  // the closed form knows no steps
  world.wall = {200, 1.5F, 0};
  world.planes = {{{0, 1, 0}, 0}};
  world.start = {{{0, 0.51F, 0}, {0, -2, 0}, 0}};
  const auto s = make(world);
  for (int step = 0; step < 4000 && position(*s, 0)[1] <= 0.52; ++step) s->step();
  const double decay = 1.5 / 2;
  const double omega = std::sqrt(200 - decay * decay);
  EXPECT_NEAR(velocity(*s, 0)[1], 2 * std::exp(-decay * std::acos(-1.0) / omega), 2e-3);
}

TEST(Physics, APairKeepsItsMomentumAndLosesEnergy) {
  EngineWorld world = empty_world(2);
  world.types = {{0.5F, 1}, {0.8F, 3}};
  world.start = {{{-2, 0.3F, 0}, {3, 0, 0.5F}, 0}, {{1, 0, 0.1F}, {-1, 0.2F, 0}, 1}};
  const auto s = make(world);
  const auto energy = [&s] {
    const Vec3 a = velocity(*s, 0);
    const Vec3 b = velocity(*s, 1);
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + 3 * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
  };
  const std::array<double, 3> momentum{3 - 3 * 1.0, 3 * 0.2, 0.5};
  const double before = energy();
  bool met = false;
  for (int frame = 0; frame < 120; ++frame) {
    s->step();
    met = met || s->colliding() == 2;
    for (std::size_t i = 0; i < 3; ++i) {
      // The accumulator acts one step later on both bodies alike, so the sum holds in every frame.
      EXPECT_NEAR(velocity(*s, 0)[i] + 3 * velocity(*s, 1)[i], momentum[i], 1e-4) << "frame " << frame;
    }
  }
  EXPECT_TRUE(met);
  EXPECT_EQ(s->colliding(), 0U);
  EXPECT_LT(energy(), before);
}

TEST(Physics, ForcesFoundInAStepActInTheNext) {
  EngineWorld world = empty_world(2);
  world.pair = {90, 0, 0};
  world.start = {{{0, 0, 0}, {}, 0}, {{0.9F, 0, 0}, {}, 0}};
  const auto s = make(world);
  s->step();
  EXPECT_EQ(velocity(*s, 0)[0], 0);
  EXPECT_EQ(s->colliding(), 2U);
  s->step();
  EXPECT_NEAR(velocity(*s, 0)[0], -90 * 0.1 / 30, 1e-5);
  EXPECT_NEAR(velocity(*s, 1)[0], 90 * 0.1 / 30, 1e-5);
}

TEST(Physics, ShearSlowsASlidingBodyAlongAPlane) {
  EngineWorld world = empty_world(1);
  world.gravity = {0, -3, 0};
  world.wall = {100, 0.5F, 1};
  world.planes = {{{0, 1, 0}, 0}};
  world.start = {{{0, 0.47F, 0}, {2, 0, 0}, 0}};
  const auto s = make(world);
  for (int frame = 0; frame < 31; ++frame) s->step();
  // 30 steps of v -= dt * (damping + shear) * v; the first step has no force yet.
  EXPECT_NEAR(velocity(*s, 0)[0], 2 * std::pow(1 - 1.5 / 30, 30), 1e-3);
}

TEST(Physics, ASphereOfTheSceneHoldsABodyOnItsTop) {
  EngineWorld world = empty_world(1);
  world.gravity = {0, -3, 0};
  world.wall = {100, 2, 2};
  world.balls = {{{1, 2, 3}, 4}};
  world.start = {{{1, 6.6F, 3}, {}, 0}};
  const auto s = make(world);
  for (int frame = 0; frame < 1000; ++frame) s->step();
  EXPECT_NEAR(position(*s, 0)[1], 6.5 - 3 / 100.0, 1e-3);
  EXPECT_NEAR(position(*s, 0)[0], 1, 1e-3);
}

TEST(Physics, ABoxTurnedByRightAnglesPushesFromFaceEdgeAndInside) {
  EngineWorld world = empty_world(3);
  world.wall = {90, 0, 0};
  Box box;
  box.centre = {0, 0, 0};
  box.half = {1, 2, 3};
  box.axes = {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}};  // its x is the scene's z: extents 2, 3, 1 along x, y, z
  world.boxes = {box};
  world.start = {{{0, 3.4F, 0}, {}, 0},          // over the face y = 3
                 {{2.3F, 3.3F, 0.5F}, {}, 0},    // off the edge x = 2, y = 3
                 {{0.5F, 0.5F, -0.9F}, {}, 0}};  // inside, nearest face z = -1
  world.low = {-9, -9, -9};
  world.high = {9, 9, 9};
  world.types = {{0.5F, 1}};
  const auto s = make(world);
  s->step();
  s->step();
  EXPECT_EQ(s->colliding(), 3U);
  EXPECT_NEAR(velocity(*s, 0)[1], 90 * 0.1 / 30, 1e-4);
  EXPECT_NEAR(velocity(*s, 0)[0], 0, 1e-6);
  const double overlap = 0.5 - std::sqrt(0.18);
  EXPECT_NEAR(velocity(*s, 1)[0], 90 * overlap / 30 / std::sqrt(2.0), 1e-3);
  EXPECT_NEAR(velocity(*s, 1)[1], 90 * overlap / 30 / std::sqrt(2.0), 1e-3);
  EXPECT_NEAR(velocity(*s, 2)[2], -90 * (0.5 + 0.1) / 30, 1e-3);
}

TEST(Physics, BodiesInOnePointPart) {
  EngineWorld world = empty_world(2);
  world.start = {{{0, 0, 0}, {}, 0}, {{0, 0, 0}, {}, 0}};
  const auto s = make(world);
  for (int frame = 0; frame < 90; ++frame) s->step();
  EXPECT_GT(position(*s, 1)[1] - position(*s, 0)[1], 0.99);
  EXPECT_NEAR(position(*s, 1)[1], -position(*s, 0)[1], 1e-5);
}

TEST(Physics, AllBodiesInOnePlaceStayFiniteAndBounded) {
  EngineWorld world = empty_world(3000);
  for (int i = 0; i < 3000; ++i) world.start.push_back({{0, 0, 0}, {}, 0});
  const auto s = make(world);
  for (int frame = 0; frame < 5; ++frame) s->step();
  for (std::uint32_t slot = 0; slot < 3000; ++slot) {
    ASSERT_TRUE(s->bodies().alive[slot] == 0 || std::isfinite(position(*s, slot)[1]));
  }
  EXPECT_LE(s->colliding(), 3000U);
}

TEST(Physics, APileOf2000ComesToRest) {
  const auto s = make(pile_world(2000, 6));
  for (int frame = 0; frame < 900; ++frame) s->step();
  EXPECT_LT(rms_speed(*s), 0.02);  // 2 % of a diameter a second; what is left is a creep that goes on slowing
  EXPECT_EQ(s->colliding(), 2000U);
}

}  // namespace
}  // namespace tandem::engine
