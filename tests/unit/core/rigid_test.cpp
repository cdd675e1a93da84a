// The predictor `rigid`.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <random>

#include "sdk/core/lattice/turn.hpp"
#include "sdk/core/predict/rigid/rigid.hpp"
#include "sdk/core/predict/rigid/solver.hpp"
#include "tests/unit/core/machines.hpp"
#include "tests/unit/core/rigid_world.hpp"

namespace tandem::of_rigid {
namespace {

TEST(Rigid, ABodyThatTouchesNothingFliesAndTurns) {
  const auto predictor = rigid(2, room());
  State state = make_state(2);
  const Spin spin{1 << 25, -12345678, 77};
  state.spawn(0, 0, kBoard, {{0, 400000, 0}, {64000, 6400, 0}, kNoTurn, spin});
  predictor->step(state, state, input_of(kGravity));
  EXPECT_EQ(state.v(1)[0], 6400 - 28000);
  EXPECT_EQ(state.v(0)[0], 64000);
  EXPECT_EQ(state.p(0)[0], 1000);
  EXPECT_EQ(state.p(1)[0], 400000 + ((6400 - 28000 * 5 / 8 + 32) >> 6));
  EXPECT_EQ(state.spin(0), spin);
  EXPECT_EQ(state.quaternion(0), turned(kNoTurn, spin));
}

TEST(Rigid, ABallFeelsARoundEdgeLaterThanASharpOneAndAFaceAsEver) {
  const auto pushed = [](const Vec3i& at, std::int32_t rounding) {
    const auto predictor = rigid(2, room());
    State state = make_state(2);
    state.spawn(0, 0, kCube, {{0, 400000, 0}, {}, kNoTurn, {}});
    state.spawn(1, 0, kBall, {{at[0], 400000 + at[1], at[2]}, {}, kNoTurn, {}});
    StepInput input = input_of({});
    input.parameters.contacts.rounding = rounding;
    predictor->step(state, state, input);
    return state.v(1)[1] != 0 || state.p(1)[1] != 400000 + at[1];
  };
  const std::int32_t radius = room().solids[kBall].size[0];
  const std::int32_t beyond = kHalf + radius * 7 / 10;  // a hundredth of the radius within the sharp edge
  EXPECT_TRUE(pushed({beyond, beyond, 0}, 0));
  EXPECT_FALSE(pushed({beyond, beyond, 0}, 6554));
  const std::int32_t above = kHalf + radius * 99 / 100;
  EXPECT_TRUE(pushed({0, above, 0}, 0));
  EXPECT_TRUE(pushed({0, above, 0}, 6554));
}

TEST(Rigid, WritesTheSameIntoTheStateItReadsAndIntoAnother) {
  std::mt19937_64 random(35);
  for (const std::int32_t substeps : {1, 2, 4, 8}) {
    const auto predictor = rigid(150, room(substeps));
    State state = block(150, true);
    State other = make_state(150);
    for (Slot s = 0; s < 150; ++s)
      for (std::size_t i = 0; i < 3; ++i) {
        state.v(i)[s] = vector_within(random, 300000)[i];
        state.w(i)[s] = vector_within(random, 1 << 26)[i];
      }
    for (int frame = 0; frame < 10; ++frame) {
      predictor->step(state, other, input_of(kGravity));
      predictor->step(state, state, input_of(kGravity));
      ASSERT_EQ(state, other) << "frame " << frame;
    }
  }
}

TEST(Rigid, NoValueLeavesItsLimits) {
  std::mt19937_64 random(36);
  RigidConstants constants = room(8);
  constants.contact.boxes = constants_of(1).boxes;
  constants.contact.balls = constants_of(1).balls;
  constants.contact.planes.push_back({{1 << 30, 1 << 30, 1 << 30}, 5});  // no unit normal
  constants.contact.planes.push_back({});
  constants.contact.types = {{1, 65536}, {1, 1 << 20}, {1, 1}, {1, 0}, {1, 65536}, {1, 65536}};
  constants.solids.push_back({Solid::Kind::kBox, {Solid::kMaxSize, 1, Solid::kMaxSize}});
  constants.solids.push_back({Solid::Kind::kRound, {1, Solid::kMaxSize, 0}});
  for (const bool large : {false, true}) {
    if (!large) constants.solids[4] = constants.solids[0], constants.solids[5] = constants.solids[2];
    if (large) constants.solids[4] = {Solid::Kind::kBox, {Solid::kMaxSize, 1, Solid::kMaxSize}};
    for (const std::int32_t spread : {0, 3, kHalf, Solid::kMaxSize, kPositionLimit}) {
      for (const std::int32_t threshold : {1, 100, kThreshold, kPositionLimit}) {
        constexpr std::uint32_t kBodies = 120;
        const auto predictor = rigid(kBodies, constants);
        State state = make_state(kBodies);
        for (Slot s = 0; s < kBodies; ++s) {
          if (s % 7 == 3) continue;
          state.spawn(
              s, 0, static_cast<TypeId>(random() % 7),
              {vector_within(random, spread), vector_within(random, kVelocityLimit), some_turn(random),
               limited_spin({static_cast<std::int64_t>(random() % (1U << 30U)), 5, -(1 << 28)})});
          for (std::size_t i = 0; i < 3; ++i) state.c(i)[s] = vector_within(random, kVelocityLimit)[i];
        }
        StepInput input = input_of({0, -kVelocityLimit, 0});
        input.threshold = threshold;
        input.parameters.contacts = {true, ContactParameters::kMaxLonger,
                                     random() % 2 == 0 ? kMaxStep : -kMaxStep,
                                     ContactParameters::kMaxFriction, ContactParameters::kMaxRounding};
        for (int frame = 0; frame < 3; ++frame) predictor->step(state, state, input);
        for (Slot s = 0; s < kBodies; ++s) {
          ASSERT_EQ(state.alive()[s], s % 7 == 3 ? 0 : 1);
          if (state.alive()[s] == 0) {
            for (std::size_t i = 0; i < kColumns; ++i) ASSERT_EQ(state.column(i)[s], 0);
          } else {
            ASSERT_TRUE(valid_body(state.body(s))) << spread << ' ' << threshold << ' ' << s;
          }
        }
      }
    }
  }
}

// No energy from nothing: a pile without corrections.
TEST(Rigid, APileComesToRestInItsRoomAndThenDoesNotMove) {
  for (const bool mixed : {false, true}) {
    constexpr std::uint32_t kBodies = 100;
    const auto predictor = rigid(kBodies, room());
    State state = block(kBodies, mixed);
    const double start = energy(state);
    double least = start;
    for (int frame = 0; frame < 1000; ++frame) {
      predictor->step(state, state, input_of(kGravity));
      const double now = energy(state);
      ASSERT_LT(now, least + 0.01 * start) << frame;
      least = std::min(least, now);
    }
    const State rested = state;
    for (int frame = 0; frame < 2000; ++frame) predictor->step(state, state, input_of(kGravity));
    for (Slot s = 0; s < kBodies; ++s) {
      EXPECT_LT(moved(state, rested, s), 2000 * 0.1 * kThreshold) << s;
      for (const std::size_t axis : {0U, 2U}) EXPECT_LT(std::abs(state.p(axis)[s]), 8 * kHalf) << s;
      EXPECT_GT(state.p(1)[s], kHalf / 4 - kThreshold) << s;
      EXPECT_LT(state.p(1)[s], 20 * kHalf) << s;
    }
    EXPECT_GT(std::count(state.own().begin(), state.own().end(), 5), kBodies * 8 / 10);
  }
}

TEST(Rigid, ATowerOfCubesStands) {
  const auto predictor = rigid(8, room());
  State state = make_state(8);
  for (Slot s = 0; s < 8; ++s)
    state.spawn(s, 0, kCube, {{0, kHalf * (2 * static_cast<std::int32_t>(s) + 1), 0}, {}});
  const State start = state;
  for (int frame = 0; frame < 300; ++frame) predictor->step(state, state, input_of(kGravity));
  for (Slot s = 0; s < 8; ++s) EXPECT_LT(moved(state, start, s), kThreshold) << s;
}

TEST(Rigid, BodiesThatSleepWakeWhenGravityTurns) {
  const auto predictor = rigid(50, room());
  State state = block(50, true);
  for (int frame = 0; frame < 1000; ++frame) predictor->step(state, state, input_of(kGravity));
  ASSERT_GT(std::count(state.own().begin(), state.own().end(), 5), 40);
  StepInput turned = input_of({20000, -20000, 0});
  turned.gravity_before = kGravity;
  predictor->step(state, state, turned);
  EXPECT_EQ(std::count(state.own().begin(), state.own().end(), 0), 50);
}

// Three fields of 150 bodies each on a floor, asleep, cubes and balls by turns.
struct Fields {
  static constexpr std::uint32_t kCapacity = 1U << 14U, kApart = 36, kBodies = 450;

  Fields() {
    RigidConstants floor = room();
    floor.contact.planes = {floor.contact.planes[3]};
    predictor = rigid(kCapacity, floor);
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(kBodies); ++i) {
      const std::int32_t row = i / 10;
      const Vec3i at{(2 * (i % 10) + 60 * (row % 3)) * kHalf, kHalf, 2 * (row / 3) * kHalf};
      state.spawn(static_cast<Slot>(i) * kApart, 0, i % 2 == 0 ? kCube : kBall, {at, {}});
    }
    for (int frame = 0; frame < 60; ++frame) step();
  }
  void step() {
    predictor->step(state, next, input_of(kGravity));
    predictor->step(state, state, input_of(kGravity));
    ASSERT_EQ(state, next);
  }

  std::unique_ptr<Predictor> predictor;
  State state = make_state(kCapacity), next = make_state(kCapacity);
};

TEST(Rigid, BodiesSleepOnWhereNobodyNearMovesAndOthersAreRoused) {
  Fields fields;
  State& state = fields.state;
  ASSERT_EQ(std::count(state.own().begin(), state.own().end(), 5), Fields::kBodies);
  constexpr Slot kLast = (Fields::kBodies - 1) * Fields::kApart;
  state.v(0)[0] = 4 * kThreshold * 64;
  state.c(1)[kLast] = 77;
  const State before = state;
  for (int frame = 0; frame < 4; ++frame) fields.step();
  std::uint32_t woken = 0;
  for (Slot s = 0; s <= kLast; s += Fields::kApart) {
    if (before.p(0)[s] > 20 * kHalf || before.p(2)[s] > 16 * kHalf) {
      EXPECT_EQ(state.body(s), before.body(s)) << s;
    }
    if (state.own()[s] != 5) ++woken;
  }
  EXPECT_GT(woken, 2U);
  EXPECT_LT(woken, 100U);
  EXPECT_EQ(state.c(1)[kLast], 77);
  // A change of gravity that is too small to wake them, but they do not sleep through it.
  StepInput turned = input_of(kGravity);
  turned.drive.gravity[0] = 1;
  fields.predictor->step(state, state, turned);
  EXPECT_NE(state.c(1)[kLast], 77);
}

TEST(Rigid, ASpinWakesABodyThatSleeps) {
  Fields fields;
  fields.state.w(1)[0] = 1 << 26;
  fields.step();
  EXPECT_LT(fields.state.own()[0], 5);
  EXPECT_LT(fields.state.own()[Fields::kApart], 5);
}

TEST(Rigid, BodiesAtRestStayAsTheyAreHoweverNearOthersMove) {
  Fields fields;
  for (Slot s = 0; s < Fields::kCapacity; ++s) {
    if (fields.state.alive()[s] == 0 || s % (2 * Fields::kApart) == 0) continue;
    fields.state.rest()[s] = 1;
    for (std::size_t i = 0; i < 3; ++i) fields.state.c(i)[s] = -kGravity[i];
  }
  const State before = fields.state;
  for (Slot s = 0; s < Fields::kCapacity; s += 10 * Fields::kApart) fields.state.v(0)[s] = -kThreshold * 64;
  fields.step();
  for (Slot s = 0; s < Fields::kCapacity; ++s) {
    if (before.rest()[s] == 0) continue;
    EXPECT_EQ(fields.state.body(s), before.body(s)) << s;
    EXPECT_EQ(fields.state.c(1)[s], before.c(1)[s]) << s;
    EXPECT_EQ(fields.state.own()[s], 0) << s;
  }
  EXPECT_NE(fields.state.body(0), before.body(0));
}

TEST(Rigid, ABodyAsleepWhoseSupportVanishesHangsUntilItIsCorrected) {
  const auto predictor = rigid(4, room());
  State state = make_state(4);
  for (Slot s = 0; s < 2; ++s)
    state.spawn(s, 0, kCube, {{0, kHalf * (2 * static_cast<std::int32_t>(s) + 1), 0}, {}});
  for (int frame = 0; frame < 20; ++frame) predictor->step(state, state, input_of(kGravity));
  ASSERT_EQ(state.own()[1], 5);
  state.despawn(0);
  const State before = state;
  for (int frame = 0; frame < 10; ++frame) predictor->step(state, state, input_of(kGravity));
  EXPECT_EQ(state, before);
  state.v(1)[1] = -1;
  for (int frame = 0; frame < 10; ++frame) predictor->step(state, state, input_of(kGravity));
  EXPECT_LT(state.p(1)[1], kHalf * 5 / 2);
}

TEST(Rigid, ManyBodiesInOnePlaceLeaveEachOtherWithoutAnExplosion) {
  const auto predictor = rigid(64, room());
  State state = make_state(64);
  for (Slot s = 0; s < 64; ++s)
    state.spawn(s, 0, static_cast<TypeId>(s % 4), {{static_cast<std::int32_t>(s), 10 * kHalf, 0}, {}});
  for (int frame = 0; frame < 300; ++frame) {
    predictor->step(state, state, input_of({}));
    for (Slot s = 0; s < 64; ++s) {
      for (std::size_t i = 0; i < 3; ++i) ASSERT_LT(std::abs(state.v(i)[s]), 64 * kHalf) << frame;
    }
  }
}

TEST(Rigid, AHeavyBodyIsPushedLessAndOneOfNoMobilityNotAtAll) {
  RigidConstants constants = room();
  constants.contact.types = {{kHalf, 65536}, {kHalf, 65536 / 4}, {kHalf, 0}, {kHalf, 65536}};
  constants.solids[1] = constants.solids[2] = constants.solids[0];
  const auto predictor = rigid(4, constants);
  State state = make_state(4);
  const auto collide = [&](Slot first, TypeId a, TypeId b, std::int32_t y) {
    state.spawn(first, 0, a, {{0, y, 0}, {640000, 0, 0}});
    state.spawn(first + 1, 0, b, {{2 * kHalf + 100, y, 0}, {}});
  };
  collide(0, 0, 1, 10 * kHalf);
  collide(2, 0, 2, 20 * kHalf);
  predictor->step(state, state, input_of({}));
  EXPECT_NEAR(state.v(0)[0], 640000 / 5, 4000);
  EXPECT_NEAR(state.v(0)[1], 640000 / 5, 4000);
  EXPECT_NEAR(state.v(0)[2], 0, 4000);
  EXPECT_EQ(state.v(0)[3], 0);
}

TEST(Rigid, ABoxThatLandsOnAnEdgeBeginsToTurn) {
  const auto predictor = rigid(1, room());
  State state = make_state(1);
  const Quaternion tilted = turned(kNoTurn, {0, 0, 1 << 27});  // half a radian
  state.spawn(0, 0, kCube, {{0, 28000, 0}, {0, -200000, 0}, tilted, {}});
  predictor->step(state, state, input_of(kGravity));
  EXPECT_LT(state.w(2)[0], -(1 << 22));
  EXPECT_NEAR(state.w(0)[0], 0, 1 << 16);
}

TEST(Rigid, FrictionSlowsASlidingBodyInTheDirectionOfItsMotion) {
  const auto predictor = rigid(1, room());
  State state = make_state(1);
  state.spawn(0, 0, kBoard, {{0, kHalf / 4, 0}, {400000, 0, 230000}});
  for (int frame = 0; frame < 6; ++frame) predictor->step(state, state, input_of(kGravity));
  EXPECT_LT(state.v(0)[0], 380000);
  EXPECT_GT(state.v(0)[0], 200000);
  EXPECT_NEAR(static_cast<double>(state.v(2)[0]) / state.v(0)[0], 230.0 / 400, 0.01);
}

TEST(Rigid, AFastBodyIsStoppedByTheFloorInOneSubstep) {
  const auto predictor = rigid(1, room(1));
  State state = make_state(1);
  state.spawn(0, 0, kBall, {{0, kHalf, 0}, {0, -30 * 64 * kThreshold, 0}});
  predictor->step(state, state, input_of(kGravity));
  EXPECT_NEAR(state.v(1)[0], 0, 64 * kThreshold / 2);
}

TEST(Rigid, BodiesThatAreNotYetNearDoNotPush) {
  const auto predictor = rigid(1, room(1));
  State state = make_state(1);
  state.spawn(0, 0, kBall, {{0, kHalf + kThreshold / 2, 0}, {0, -64 * kThreshold, 0}});
  predictor->step(state, state, input_of({}));
  EXPECT_EQ(state.v(1)[0], -64 * kThreshold);
  predictor->step(state, state, input_of({}));
  EXPECT_GE(state.v(1)[0], 0);
}

TEST(Rigid, KeepsBodiesOutOfBoxesAndBalls) {
  RigidConstants constants = room();
  constants.contact.boxes = constants_of(1).boxes;
  constants.contact.balls = constants_of(1).balls;
  constants.contact.planes = {constants.contact.planes[3]};
  const auto predictor = rigid(2, constants);
  State state = make_state(2);
  state.spawn(0, 0, kCube, {{200000, 90000, 0}, {0, -200000, 0}});
  state.spawn(1, 0, kBall, {{-200000, 100000, 0}, {0, -200000, 0}});
  for (int frame = 0; frame < 60; ++frame) predictor->step(state, state, input_of(kGravity));
  EXPECT_NEAR(state.p(1)[0], 50000 + kHalf, kThreshold);
  EXPECT_NEAR(state.p(1)[1], 60000 + kHalf, kThreshold);
}

TEST(Rigid, AStepThatChangesNothingIsTheSameAsOneOfAnotherPredictor) {
  constexpr std::uint32_t kBodies = 8;
  const auto kept = rigid(kBodies, room());
  State state = make_state(kBodies);
  for (Slot s = 0; s < kBodies; ++s)
    state.spawn(s, 0, kCube, {{0, kHalf * (2 * static_cast<std::int32_t>(s) + 1), 0}, {}});
  for (int frame = 0; frame < 500; ++frame) kept->step(state, state, input_of(kGravity));
  State next = make_state(kBodies);
  kept->step(state, next, input_of(kGravity));
  ASSERT_EQ(next, state);
  const auto expect_same = [&](const State& from, const StepInput& input) {
    State expected = make_state(kBodies);
    State found = make_state(kBodies);
    rigid(kBodies, room())->step(from, expected, input);
    kept->step(from, found, input);
    EXPECT_EQ(found, expected);
    kept->step(state, next, input_of(kGravity));
    EXPECT_EQ(next, state);
  };
  expect_same(state, input_of(kGravity));
  expect_same(state, input_of({0, 28000, 0}));
  State changed = state;
  changed.q(0)[3] += 1000;
  expect_same(changed, input_of(kGravity));
  changed = state;
  changed.w(1)[2] = 1 << 20;
  expect_same(changed, input_of(kGravity));
  changed = state;
  changed.despawn(3);
  expect_same(changed, input_of(kGravity));
}

TEST(Rigid, RefusesConstantsOutOfRange) {
  EXPECT_TRUE(make_predictor("rigid", 1U << 10U, write_rigid_constants(room())));
  EXPECT_FALSE(make_predictor("rigid", (1U << 14U) + 1, write_rigid_constants(room())));
  EXPECT_FALSE(make_predictor("rigid", 100, {}));
  EXPECT_FALSE(make_predictor("rigid", 100, write_contact_constants(room().contact)));
  const auto refused = [](const auto& change) {
    RigidConstants constants = room();
    change(constants);
    return !make_predictor("rigid", 100, write_rigid_constants(constants));
  };
  EXPECT_TRUE(refused([](RigidConstants& c) { c.contact.substeps = 3; }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.contact.substeps = 16; }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.solids[0].size[1] = 0; }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.solids[0].size[1] = Solid::kMaxSize + 1; }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.solids[1].size = {0, 5, 0}; }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.solids[1].size = {5, -1, 0}; }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.solids[1].size = {5, 5, 5}; }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.solids[2].kind = static_cast<Solid::Kind>(2); }));
  EXPECT_TRUE(refused([](RigidConstants& c) { c.solids.pop_back(); }));
  std::vector<std::int32_t> values = write_rigid_constants(room());
  values[7] = INT32_MAX;
  EXPECT_FALSE(make_predictor("rigid", 100, values));
  values[7] = 0;
  EXPECT_FALSE(make_predictor("rigid", 100, values));
}

struct Solved {
  std::vector<RigidRow> now, base, way, fall;
  std::vector<RigidMoved> moved;
  std::vector<RigidGroup> groups;
  std::vector<RigidContact> contacts;
};

// Pairs of any points, in two waves; normals and arms need not be such as bodies have.
Solved solve(const RigidKernels& kernels, std::uint64_t seed) {
  using L = RigidSolverLaw;
  constexpr std::size_t kPairs = RigidGroup::kPairs;
  constexpr std::uint32_t kHalfOfBodies = 2 * kPairs, kBodies = 2 * kHalfOfBodies, kGroups = 4;
  std::mt19937_64 random(seed);
  const std::int32_t speed = seed % 3 == 0 ? L::kMaxStart : 700;
  const auto some = [&random](std::int32_t most) {
    return static_cast<std::int16_t>(vector_within(random, most)[0]);
  };
  Solved solved;
  solved.now.resize(kBodies + 1);
  solved.base = solved.way = solved.fall = solved.now;
  solved.moved.resize(kBodies + 1);
  std::vector<RigidMass> masses(kBodies + 1);
  for (std::uint32_t place = 0; place < kBodies; ++place) {
    for (std::size_t i = 0; i < 3; ++i) {
      solved.now[place].v[i] = some(speed);
      solved.now[place].w[i] = some(speed);
      solved.fall[place].v[i] = some(speed / 3);
    }
    for (std::int32_t& x : masses[place].inertia) x = some(seed % 2 == 0 ? 4600 : INT16_MAX);
  }
  std::vector<RigidFound> found;
  std::vector<RigidTouch> touches;
  for (std::uint32_t i = 0; i < kGroups * kPairs; ++i) {
    const std::uint32_t place = i % kHalfOfBodies;
    const bool is_wall = i % 7 == 6;
    const auto count = static_cast<std::uint16_t>(random() % 5);
    const bool alike = !is_wall && i / kPairs != 1;
    touches.push_back({place, is_wall ? kBodies : kBodies - 1 - place,
                       static_cast<std::uint32_t>(found.size()), 0, count,
                       alike ? std::int16_t{L::kOne} : some(L::kOne),
                       is_wall ? std::int16_t{0} : std::int16_t{L::kOne}, 0});
    for (int k = 0; k < 5; ++k) {
      RigidFound point{};
      for (std::size_t m = 0; m < 3; ++m) {
        point.n[m] = some(seed % 5 == 0 ? L::kOne : L::kOne * 6 / 10);
        point.arm_a[m] = some(L::kOne);
        point.arm_b[m] = is_wall ? std::int16_t{0} : some(L::kOne);
      }
      point.gap = vector_within(random, 500)[0];
      found.push_back(point);
    }
  }
  solved.groups.resize(kGroups);
  solved.contacts.resize(5 * kGroups);
  std::uint32_t first = 0;
  for (std::uint32_t g = 0; g < kGroups; ++g) {
    std::array<const RigidTouch*, kPairs> pairs{};
    for (std::uint32_t k = 0; k < kPairs; ++k) pairs[k] = &touches[kPairs * g + k];
    solved.groups[g].first = first;
    kernels.put(pairs.data(), found.data(), masses.data(), solved.now.data(), solved.fall.data(),
                static_cast<std::uint32_t>(seed % 4), solved.groups[g], &solved.contacts[first]);
    first += solved.groups[g].count;
  }
  solved.contacts.resize(first);
  kernels.solve({static_cast<std::uint32_t>(seed % 4), 30, 200, seed % 2 == 0 ? 1024 : 1 << 14, 256},
                solved.groups.data(), kGroups, solved.contacts.data(),
                {solved.now.data(), solved.base.data(), solved.way.data(), solved.fall.data(),
                 solved.moved.data(), kBodies + 1});
  return solved;
}

TEST(RigidKernels, GiveTheSameBitsOnEveryMachine) {
  for (std::uint64_t seed = 0; seed < 80; ++seed) {
    const Solved portable = solve(portable_rigid_kernels(), seed);
    const Solved fastest = solve(seed % 2 == 0 ? fastest_rigid_kernels() : rigid_one_by_one(), seed);
    const auto same = [](const auto& a, const auto& b) {
      return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0;
    };
    EXPECT_TRUE(same(fastest.now, portable.now)) << seed;
    EXPECT_TRUE(same(fastest.moved, portable.moved)) << seed;
    EXPECT_TRUE(same(fastest.contacts, portable.contacts)) << seed;
    const RigidRow zero{};
    EXPECT_EQ(std::memcmp(&portable.now.back(), &zero, sizeof zero), 0);
    bool any = false;
    for (const RigidContact& contact : portable.contacts)
      any = std::any_of(std::begin(contact.normal.push), std::end(contact.normal.push),
                        [](auto x) { return x != 0; }) ||
            any;
    EXPECT_TRUE(any);
  }
}

TEST(RigidPairKernels, GiveTheSameBitsOnEveryMachine) {
  constexpr std::uint32_t kBodies = 256;
  constexpr std::size_t kBlocks = 8, kPairs = RigidBoxPoints::kPairs;
  const RigidPairKernels portable = portable_rigid_pair_kernels();
  const auto same = [](const auto& a, const auto& b) { return std::memcmp(&a, &b, sizeof a) == 0; };
  std::size_t touched = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const RigidPairKernels fastest = seed % 2 == 0 ? fastest_rigid_pair_kernels() : rigid_pair_by_pair();
    std::mt19937_64 random(seed);
    // Every third time of any words, without sense.
    const bool any = seed % 3 == 2;
    const auto some = [&random](std::int32_t most) {
      return static_cast<std::int16_t>(vector_within(random, most)[0]);
    };
    std::vector<RigidSolidWords> solids(kBodies);
    for (RigidSolidWords& solid : solids) {
      const auto axes = axes_of(some_turn(random));
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t m = 0; m < 3; ++m)
          solid.axes[i][m] =
              any ? some(INT16_MAX) : static_cast<std::int16_t>(std::min(axes[i][m] >> 9, INT16_MAX));
        solid.size[i] = static_cast<std::int16_t>(seed % 2 == 0 ? 3000 : 500 + random() % 4000);
      }
      solid.radius = any ? some(INT16_MAX) : std::int16_t{5197};
      solid.scale = 4;
      solid.inverse = 6456;
    }
    std::vector<RigidBoxPair> pairs(kBlocks * kPairs);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      pairs[i] = {{},
                  300,
                  static_cast<std::uint16_t>(random() % kBodies),
                  static_cast<std::uint16_t>(random() % kBodies),
                  static_cast<std::uint32_t>(i)};
      for (std::int16_t& d : pairs[i].d) d = some(any ? INT16_MAX : 6000);
      if (i % 5 == 4) pairs[i] = {{}, INT16_MIN, 0, 0, 0};
    }
    std::vector<RigidBoxPair> others = pairs;
    const std::size_t kept = portable.keep_near(pairs.data(), pairs.size(), solids.data());
    ASSERT_EQ(fastest.keep_near(others.data(), others.size(), solids.data()), kept) << seed;
    for (std::size_t i = 0; i < kept; ++i) ASSERT_EQ(others[i].of, pairs[i].of) << seed;
    for (std::size_t first = 0; first + kPairs <= kept; first += kPairs) {
      RigidBoxPoints one{};
      RigidBoxPoints other{};
      portable.touch_boxes(&pairs[first], solids.data(), one);
      fastest.touch_boxes(&pairs[first], solids.data(), other);
      for (std::size_t lane = 0; lane < kPairs; ++lane) {
        ASSERT_EQ(one.pairs[lane].count, other.pairs[lane].count) << seed;
        if (one.pairs[lane].count == 0) continue;
        ++touched;
        EXPECT_TRUE(same(one.pairs[lane], other.pairs[lane])) << seed;
        for (std::size_t m = 0; m < RigidBoxPoints::kPoints; ++m)
          EXPECT_TRUE(same(one.points[m][lane], other.points[m][lane])) << seed;
      }
    }
  }
  EXPECT_GT(touched, 100U);
}

}  // namespace
}  // namespace tandem::of_rigid
