// Bodies that are listed, adopted, fall asleep and wake, with the same bits on any number of threads, in any
// instruction set, and from a checkpoint.
#include <algorithm>
#include <array>
#include <functional>
#include <initializer_list>
#include <vector>

#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

constexpr float kSleepSpeed = 0.03F;

EngineWorld sleepy_pile(std::uint32_t bodies, float half) {
  EngineWorld world = pile_world(bodies, half);
  world.damping_per_s = 0.5F;
  world.sleep_speed = kSleepSpeed;
  return world;
}

/// Slots whose bodies did not move in a step.
std::uint32_t standing(Simulation& s) {
  const auto before = [&] {
    std::vector<float> all;
    for (const auto& column : s.bodies().position) all.insert(all.end(), column.begin(), column.end());
    return all;
  };
  const std::vector<float> was = before();
  s.step();
  const std::uint32_t n = s.capacity();
  std::uint32_t count = 0;
  for (std::uint32_t slot = 0; slot < n; ++slot) {
    bool same = true;
    for (std::size_t i = 0; i < 3; ++i) same = same && was[i * n + slot] == s.bodies().position[i][slot];
    count += same ? 1 : 0;
  }
  return count;
}

std::unique_ptr<Simulation> sleeping_pile() {
  auto s = make(sleepy_pile(1000, 5));
  for (int frame = 0; frame < 1500; ++frame) s->step();
  return s;
}

TEST(Sleep, APileAtRestStandsStillAndStillTouches) {
  const auto s = sleeping_pile();
  EXPECT_EQ(standing(*s), 1000U);
  EXPECT_EQ(s->colliding(), 1000U);
  EXPECT_EQ(rms_speed(*s), 0);
}

// Only blocks in which a value changed are said to have moved, and all of those.
TEST(Sleep, TheEngineSaysInWhichBlocksAnybodyMoved) {
  constexpr std::uint32_t kBodies = 2 * kMovedSlots + 500;
  const auto s = make(sleepy_pile(kBodies, 110));  // one layer
  std::uint32_t silent = 0, wrong = 0;
  const auto columns = [&] {
    std::vector<float> all;
    const Bodies bodies = s->bodies();
    for (const auto* const axes : {&bodies.position, &bodies.velocity}) {
      for (const auto& column : *axes) all.insert(all.end(), column.begin(), column.end());
    }
    return all;
  };
  std::vector<float> was = columns();
  for (int frame = 0; frame < 400; ++frame) {
    // A push at a corner, long after all fell asleep.
    if (frame == 330)
      s->apply({static_cast<std::uint32_t>(InputKind::kPush), {-109, 0.5, -109, 3, 0, 1, 0}, {}});
    s->step();
    std::vector<float> now = columns();
    ASSERT_EQ(s->moved().size(), 3U);
    for (std::uint32_t slot = 0; slot < kBodies; ++slot) {
      if (s->moved()[slot / kMovedSlots] != 0) continue;
      for (std::size_t column = 0; column < 6; ++column)
        wrong += now[column * kBodies + slot] != was[column * kBodies + slot] ? 1U : 0U;
    }
    for (const std::uint8_t moved : s->moved()) silent += moved == 0 ? 1U : 0U;
    if (frame == 331) {
      EXPECT_EQ(s->moved()[0], 1) << "the pushed block moves";
      EXPECT_EQ(s->moved()[2], 0) << "and it alone";
    }
    was = std::move(now);
  }
  EXPECT_EQ(wrong, 0U);
  EXPECT_GT(silent, 0U);
}

TEST(Sleep, WithoutASpeedNobodySleeps) {
  EngineWorld world = sleepy_pile(300, 3);
  world.sleep_speed = 0;
  const auto s = make(world);
  for (int frame = 0; frame < 1500; ++frame) s->step();
  EXPECT_LT(standing(*s), 300U);
}

TEST(Sleep, ANegativeSpeedIsRefused) {
  EngineWorld world = empty_world(1);
  world.sleep_speed = -1;
  EXPECT_FALSE(make_particles(world, 1));
}

TEST(Sleep, ABodyInFreeFlightStaysAwakeHoweverSlow) {
  EngineWorld world = empty_world(1);
  world.sleep_speed = 1;
  world.start = {{{0, 0, 0}, {0.1F, 0, 0}, 0}};
  const auto s = make(world);
  for (int frame = 0; frame < 300; ++frame) s->step();
  EXPECT_NEAR(position(*s, 0)[0], 1, 1e-4);
}

TEST(Sleep, AChangeOfGravityWakesAll) {
  const auto s = sleeping_pile();
  s->apply(gravity_input(1, -2.8, 0));
  s->step();
  EXPECT_LT(standing(*s), 20U);
}

TEST(Sleep, APushWakesThoseThatItReachesAndTheyWakeThoseThatTheyTouch) {
  const auto s = sleeping_pile();
  const Vec3 at = position(*s, 999);
  s->apply(push_input(at, 0.2, {0, -8, 0}));
  s->step();
  EXPECT_NE(velocity(*s, 999)[1], 0);
  for (int frame = 0; frame < 10; ++frame) s->step();
  std::uint32_t moving = 0;
  for (std::uint32_t slot = 0; slot < 1000; ++slot) moving += velocity(*s, slot)[1] != 0 ? 1U : 0U;
  EXPECT_GT(moving, 5U);
}

TEST(Sleep, ABodyWhoseSupportIsPushedAwayFalls) {
  EngineWorld world = empty_world(2);
  world.gravity = {0, -3, 0};
  world.damping_per_s = 0.5F;
  world.sleep_speed = kSleepSpeed;
  world.wall = world.pair = {200, 3, 3};
  world.planes = {{{0, 1, 0}, 0}};
  world.start = {{{0, 0.5F, 0}, {}, 0}, {{0, 1.45F, 0}, {}, 0}};
  const auto s = make(world);
  for (int frame = 0; frame < 600; ++frame) s->step();
  ASSERT_EQ(standing(*s), 2U);
  s->apply(push_input(position(*s, 0), 0.3, {20, 0, 0}));
  for (int frame = 0; frame < 600; ++frame) s->step();
  EXPECT_NEAR(position(*s, 1)[1], 0.485, 0.02);
}

TEST(Sleep, AStirredPileComesToRestAgain) {
  const auto s = sleeping_pile();
  s->apply(push_input({0, 3, 0}, 3, {3, 6, 0}));
  s->step();
  EXPECT_GT(rms_speed(*s), 0.1);
  for (int frame = 0; frame < 1500; ++frame) s->step();
  EXPECT_EQ(standing(*s), 1000U);
}

EngineWorld lively_world(std::uint32_t bodies, float half) {
  EngineWorld world = sleepy_pile(bodies, half);
  world.types = {{0.5F, 1}, {0.35F, 0.4F}};
  for (std::size_t i = 0; i < world.start.size(); i += 3) world.start[i].type = 1;
  world.capacity = bodies + 200;
  world.boxes = {{{1, 2, 0}, {1, 1, 2}, {{{1, 0, 0}, {0, 0.8F, 0.6F}, {0, -0.6F, 0.8F}}}}};
  world.balls = {{{-3, 0, 0}, 2}};
  world.emitters = {{{-1, 20, -1}, {1, 22, 1}, {0, -3, 0}, 9, 1}};
  world.regions = {{{-half, -1, -half}, {-half + 1, 1, -half + 1}, Region::Action::kRemove, {}, 0},
                   {{-half, -1, half - 1}, {-half + 1, 1, half}, Region::Action::kTeleport, {2, 9, -2}, 0},
                   {{half - 1, -1, half - 1}, {half, 1, half}, Region::Action::kSetType, {}, 1}};
  return world;
}

void disturb_seldom(Simulation& s, int frame) {
  if (frame == 300) s.apply(push_input({0, 2, 0}, 1.5, {0, 5, 1}));
  if (frame == 420) s.apply(gravity_input(0.5, -3, 0));
}

void check_all_alike(const EngineWorld& world, int frames,
                     const std::function<void(Simulation&, int)>& disturb) {
  const auto reference = make(world, 1, Instructions::kScalar);
  std::vector<std::unique_ptr<Simulation>> others;
  others.push_back(make(world, 1, Instructions::kAvx2));
  others.push_back(make(world, 1, Instructions::kAvx512));
  others.push_back(make(world, 2));
  others.push_back(make(world, 3, Instructions::kScalar));
  for (int frame = 1; frame <= frames; ++frame) {
    disturb(*reference, frame);
    reference->step();
    for (std::size_t i = 0; i < others.size(); ++i) {
      disturb(*others[i], frame);
      others[i]->step();
      ASSERT_TRUE(same_bodies(*reference, *others[i])) << "frame " << frame << ", variant " << i;
      ASSERT_EQ(reference->colliding(), others[i]->colliding());
    }
  }
}

TEST(Pile, ThreadsAndInstructionsChangeNoBitWhileBodiesSleepAndWake) {
  check_all_alike(lively_world(1000, 5), 600, disturb_seldom);
}

TEST(Pile, ThreadsAndInstructionsChangeNoBitOf100000Bodies) {
  check_all_alike(pile_world(100'000, 32), 12, [](Simulation& s, int frame) {
    if (frame == 3) s.apply(push_input({0, 10, 0}, 9, {40, 30, 0}));
    if (frame == 8) s.apply(gravity_input(20, -3, 0));
  });
}

// Each step gives many bodies new anchors, and now and then all are sorted.
TEST(Pile, ThreadsAndInstructionsChangeNoBitOfABedThatIsStirred) {
  EngineWorld world = pile_world(8000, 22);
  world.sleep_speed = kSleepSpeed;
  check_all_alike(world, 60, [](Simulation& s, int frame) {
    const double at = static_cast<double>(frame % 5) * 8 - 16;
    if (frame % 3 == 0) s.apply(push_input({at, 2, -at}, 4, {2, 5, -1}));
  });
}

TEST(Pile, AllInOnePlaceIsTheSameOnEveryMachine) {
  EngineWorld world = empty_world(700);
  for (int i = 0; i < 700; ++i) world.start.push_back({{0, 0, 0}, {}, 0});
  check_all_alike(world, 20, [](Simulation&, int) {});
}

/// What the law of contacts gives each body's velocity in the next step, from all pairs; in doubles.
std::vector<Vec3> next_velocities(const EngineWorld& world, const Simulation& s, std::uint32_t& touching) {
  const std::uint32_t n = s.capacity();
  std::vector<Vec3> at(n), v(n), force(n);
  std::vector<bool> touches(n);
  std::vector<double> radius(n, -1);
  for (std::uint32_t i = 0; i < n; ++i) {
    at[i] = position(s, i);
    v[i] = velocity(s, i);
    if (s.bodies().alive[i] != 0) radius[i] = double{world.types[s.bodies().type[i]].radius};
  }
  // Adds the force of what lies `overlap` deep towards `into`, and moves by `u` relative to the body.
  const auto add = [&](std::uint32_t body, const Material& m, double overlap, const Vec3& into,
                       const Vec3& u) {
    const double along = into[0] * u[0] + into[1] * u[1] + into[2] * u[2];
    for (std::size_t i = 0; i < 3; ++i) {
      force[body][i] += double{m.damping} * u[i] - double{m.spring} * overlap * into[i] +
                        double{m.shear} * (u[i] - along * into[i]);
    }
    touches[body] = true;
  };
  for (std::uint32_t a = 0; a < n; ++a) {
    if (radius[a] < 0) continue;
    for (const Plane& plane : world.planes) {
      const Vec3 into{-double{plane.normal[0]}, -double{plane.normal[1]}, -double{plane.normal[2]}};
      const double overlap =
          radius[a] + at[a][0] * into[0] + at[a][1] * into[1] + at[a][2] * into[2] + double{plane.offset};
      if (overlap > 0) add(a, world.wall, overlap, into, {-v[a][0], -v[a][1], -v[a][2]});
    }
    for (std::uint32_t b = a + 1; b < n; ++b) {
      const Vec3 d{at[b][0] - at[a][0], at[b][1] - at[a][1], at[b][2] - at[a][2]};
      const double squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], reach = radius[a] + radius[b];
      if (squared >= reach * reach || radius[b] < 0) continue;
      const double distance = std::sqrt(squared);
      const Vec3 n_ab{d[0] / distance, d[1] / distance, d[2] / distance};
      const Vec3 u{v[b][0] - v[a][0], v[b][1] - v[a][1], v[b][2] - v[a][2]};
      add(a, world.pair, reach - distance, n_ab, u);
      add(b, world.pair, reach - distance, {-n_ab[0], -n_ab[1], -n_ab[2]}, {-u[0], -u[1], -u[2]});
    }
  }
  touching = static_cast<std::uint32_t>(std::count(touches.begin(), touches.end(), true));
  const double dt = double{world.dt_s}, keep = 1 - double{world.damping_per_s} * dt;
  for (std::uint32_t body = 0; body < n; ++body) {
    const double scale = dt / double{world.types[s.bodies().type[body]].mass};
    for (std::size_t i = 0; i < 3; ++i)
      v[body][i] = (v[body][i] + dt * s.gravity()[i] + scale * force[body][i]) * keep;
  }
  return v;
}

/// Compares steps with the law over all pairs, which no list can miss.
void check_law(const EngineWorld& world, int frames, const std::function<void(Simulation&, int)>& disturb) {
  const auto s = make(world);
  for (int frame = 0; frame < frames; ++frame) {
    disturb(*s, frame);
    std::uint32_t touching = 0;
    const std::vector<Vec3> expected = next_velocities(world, *s, touching);
    if (frame > 0) {
      ASSERT_EQ(s->colliding(), touching) << "frame " << frame;
    }
    s->step();
    if (frame == 0) continue;  // the forces of the step before there was none
    double furthest = 0;
    for (std::uint32_t slot = 0; slot < s->capacity(); ++slot) {
      if (s->bodies().alive[slot] == 0) continue;
      const Vec3 is = velocity(*s, slot);
      for (std::size_t i = 0; i < 3; ++i) furthest = std::max(furthest, std::fabs(is[i] - expected[slot][i]));
    }
    ASSERT_LT(furthest, 1e-4) << "frame " << frame;
  }
}

TEST(Pile, ADensePileFeelsEachPairThatTouches) {
  check_law(pile_world(1000, 3), 150, [](Simulation&, int) {});
}

TEST(Pile, BodiesThatAreThrownAboutFeelEachPairThatTouches) {
  EngineWorld world = pile_world(1000, 5);
  world.types = {{0.5F, 1}, {0.3F, 0.3F}};
  for (std::size_t i = 0; i < world.start.size(); i += 3) world.start[i].type = 1;
  check_law(world, 200, [](Simulation& s, int frame) {
    if (frame % 40 == 20) s.apply(gravity_input(frame % 80 == 20 ? 4 : -4, frame % 3 == 0 ? -6 : 3, 1));
  });
}

// A pair that only one of its bodies had in its list would change the sum.
TEST(Pile, BodiesThatFlyThroughEachOtherKeepTheirMomentum) {
  EngineWorld world = pile_world(3000, 7);
  world.gravity = {0, 0, 0};
  world.planes.clear();
  world.pair = {200, 0.05F, 0.05F};
  world.low = {-900, -900, -900};
  world.high = {900, 900, 900};
  for (StartBody& body : world.start) {
    for (std::size_t i = 0; i < 3; ++i) {
      body.position[i] *= 0.8F;
      body.velocity[i] = -0.3F * body.position[i];
    }
  }
  const auto s = make(world);
  const auto momentum = [&s] {
    Vec3 sum{};
    for (std::uint32_t slot = 0; slot < s->capacity(); ++slot)
      for (std::size_t i = 0; i < 3; ++i) sum[i] += velocity(*s, slot)[i];
    return sum;
  };
  const Vec3 before = momentum();
  for (int frame = 0; frame < 150; ++frame) {
    s->step();
    for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR(momentum()[i], before[i], 0.01) << "frame " << frame;
  }
  EXPECT_GT(rms_speed(*s), 1);
}

TEST(Pile, OneBodyAtTheFarEndOfTheWorldIsTheSameOnEveryMachine) {
  EngineWorld world = pile_world(500, 4);
  world.low = {-9000, -5, -9000};
  world.high = {9000, 900, 9000};
  world.planes = {{{0, 1, 0}, 0}};
  world.start.back().position = {8999, 890, -8999};
  check_all_alike(world, 100, [](Simulation&, int) {});
  const auto s = make(world);
  for (int frame = 0; frame < 100; ++frame) s->step();
  EXPECT_NEAR(position(*s, 499)[0], 8999, 0.01);
}

TEST(Pile, BodiesInsideEachOtherComeApartAlikeOnEveryMachine) {
  EngineWorld world = empty_world(600);
  world.pair = {200, 1.5F, 1.5F};
  world.damping_per_s = 0.5F;
  for (int i = 0; i < 600; ++i)  // pairs in one point, 0.2 radii from the next
    world.start.push_back({{0.1F * static_cast<float>(i / 2 % 10), 0.1F * static_cast<float>(i / 20 % 10),
                            0.1F * static_cast<float>(i / 200)},
                           {},
                           0});
  check_all_alike(world, 60, [](Simulation&, int) {});
  const auto s = make(world);
  for (int frame = 0; frame < 60; ++frame) s->step();
  for (std::uint32_t slot = 0; slot < 600; ++slot)
    for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(std::isfinite(position(*s, slot)[i])) << slot;
}

/// Saves at each of `frames`, and follows the run beside the one that was loaded.
void check_goes_on(const EngineWorld& world, std::initializer_list<int> frames, int further,
                   const std::function<void(Simulation&, int)>& disturb) {
  const auto s = make(world);
  int frame = 0;
  std::vector<std::pair<int, std::unique_ptr<Simulation>>> loaded;
  for (const int at : frames) {
    for (; frame < at;) {
      disturb(*s, ++frame);
      s->step();
      for (auto& [from, t] : loaded) {
        disturb(*t, frame);
        t->step();
        ASSERT_TRUE(same_bodies(*s, *t)) << "frame " << frame << ", from " << from;
      }
    }
    std::vector<std::byte> bytes, again;
    s->save(bytes);
    loaded.emplace_back(at, make(world, 2));
    ASSERT_TRUE(loaded.back().second->load(bytes));
    loaded.back().second->save(again);
    EXPECT_TRUE(bytes == again);
  }
  for (int i = 0; i < further; ++i) {
    disturb(*s, ++frame);
    s->step();
    for (auto& [from, t] : loaded) {
      disturb(*t, frame);
      t->step();
      ASSERT_TRUE(same_bodies(*s, *t)) << "frame " << frame << ", from " << from;
      ASSERT_EQ(s->colliding(), t->colliding());
    }
  }
}

TEST(Pile, ACheckpointOfBodiesThatSleepFallAndAreAdoptedGoesOnBitForBit) {
  check_goes_on(lively_world(1000, 5), {1, 20, 77, 150, 290, 301, 310, 419, 500}, 150, disturb_seldom);
}

// Those that leave had moved away from their anchors, and must not count any more when it is decided to sort
// all.
TEST(Pile, ACheckpointOfAPileThatIsShotAwayGoesOnBitForBit) {
  EngineWorld world = pile_world(2000, 8);
  world.regions = {{{-8, 9, -8}, {8, 40, 8}, Region::Action::kRemove, {}, 0}};
  check_goes_on(world, {150, 160, 170, 180, 190, 200}, 60, [](Simulation& s, int frame) {
    if (frame < 120) return;
    const double x = frame % 8 * 2 - 7, z = frame / 8 % 8 * 2 - 7;
    s.apply(push_input({x, 6, z}, 1.5, {0, 45, 0}));
  });
}

TEST(Pile, ACheckpointOfACrowdGoesOnBitForBit) {
  EngineWorld world = empty_world(300);
  for (int i = 0; i < 300; ++i) world.start.push_back({{0.001F * static_cast<float>(i), 0, 0}, {}, 0});
  check_goes_on(world, {1, 2, 5}, 40, [](Simulation&, int) {});
}

TEST(Pile, ACheckpointOfAWorldThatSleepsOtherwiseIsRefusedAndChangesNothing) {
  EngineWorld world = lively_world(300, 3);
  const auto s = make(world);
  for (int frame = 0; frame < 50; ++frame) s->step();
  std::vector<std::byte> bytes;
  s->save(bytes);
  world.sleep_speed *= 2;
  const auto t = make(world), untouched = make(world);
  EXPECT_FALSE(t->load(bytes));
  for (int frame = 0; frame < 50; ++frame) {
    t->step();
    untouched->step();
  }
  EXPECT_TRUE(same_bodies(*t, *untouched));
}

}  // namespace
}  // namespace tandem::engine
