// The predictor `hard`. Lengths in radii of type 0; the threshold is a tenth of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

#include "sdk/core/lattice/turn.hpp"
#include "sdk/core/predict/hard/meet.hpp"
#include "sdk/core/predict/hard/solver.hpp"
#include "tests/unit/core/contact_world.hpp"
#include "tests/unit/core/machines.hpp"

namespace tandem {
namespace {

constexpr std::int32_t kThreshold = kRadius / 10;
constexpr Vec3i kGravity{0, -28000, 0};  // 0.22 thresholds a frame^2, as of spheres of 1 m at 30 Hz

StepInput input_of(const Vec3i& gravity) {
  StepParameters parameters{.decay = 800, .contacts = {.listed = true, .friction = 819}};
  return {{gravity, 0}, parameters, kThreshold, gravity};
}

// A room of six planes, 8 radii wide and deep.
ContactConstants room() {
  constexpr std::int32_t kOne = ContactConstants::kOne;
  ContactConstants constants = constants_of(1);
  constants.boxes.clear();
  constants.balls.clear();
  constants.planes.clear();
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::int32_t sign : {-1, 1}) {
      ContactConstants::Plane plane;
      plane.normal[i] = sign * kOne;
      plane.offset = i == 1 && sign > 0 ? 0 : -(i == 1 ? 40 : 8) * kRadius;
      constants.planes.push_back(plane);
    }
  }
  return constants;
}

State make_state(std::uint32_t capacity) {
  State state(capacity);
  state.keep_for_predictor(1);
  return state;
}

std::unique_ptr<Predictor> hard(std::uint32_t capacity, const ContactConstants& constants) {
  return predictor_of("hard", capacity, constants);
}

// A loose block of bodies above the floor.
State block(std::uint32_t bodies) {
  State state = make_state(bodies);
  for (Slot s = 0; s < bodies; ++s) {
    const auto i = static_cast<std::int32_t>(s);
    const auto at = [](std::int32_t cell) { return cell * (2 * kRadius + 700) - 7 * kRadius; };
    state.spawn(s, 0, 0, {{at(i % 7) + i * 13, at(i / 49) + 8 * kRadius, at(i / 7 % 7) + i * 7}, {}});
  }
  return state;
}

double moved(const State& a, const State& b, Slot s) {
  return std::sqrt(static_cast<double>(
      distance_squared({a.p(0)[s], a.p(1)[s], a.p(2)[s]}, {b.p(0)[s], b.p(1)[s], b.p(2)[s]})));
}

TEST(Hard, ABodyThatTouchesNothingFliesInFourSubSteps) {
  const auto predictor = hard(2, constants_of(1));
  State state = make_state(2);
  state.spawn(0, 0, 0, {{0, 1000000, 0}, {64000, 6400, 0}});
  predictor->step(state, state, input_of(kGravity));
  EXPECT_EQ(state.v(1)[0], 6400 - 28000);
  EXPECT_EQ(state.v(0)[0], 64000);
  EXPECT_EQ(state.p(0)[0], 1000);
  EXPECT_EQ(state.p(1)[0], 1000000 + ((6400 - 28000 * 5 / 8 + 32) >> 6));
}

TEST(Hard, WritesTheSameIntoTheStateItReadsAndIntoAnother) {
  constexpr std::uint64_t kSeed = 35;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const auto predictor = hard(300, constants_of(1));
  State state = bodies_within(random, 300, 6 * kRadius, 300000);
  state.keep_for_predictor(1);
  State other = make_state(300);
  for (int frame = 0; frame < 20; ++frame) {
    predictor->step(state, other, input_of(kGravity));
    predictor->step(state, state, input_of(kGravity));
    ASSERT_EQ(state, other) << "frame " << frame;
  }
}

TEST(Hard, NoValueLeavesItsLimits) {
  constexpr std::uint64_t kSeed = 36;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  for (const std::int32_t spread : {0, 3, kRadius, kPositionLimit}) {
    for (const std::int32_t threshold : {1, 100, kThreshold, kPositionLimit}) {
      const auto predictor = hard(400, constants_of(1));
      State state = bodies_within(random, 400, spread, kVelocityLimit);
      state.keep_for_predictor(1);
      StepInput input = input_of({0, -kVelocityLimit, 0});
      input.threshold = threshold;
      input.parameters.contacts = {true, ContactParameters::kMaxLonger, -kMaxStep,
                                   ContactParameters::kMaxFriction};
      for (int frame = 0; frame < 4; ++frame) predictor->step(state, state, input);
      for (Slot s = 0; s < 400; ++s) {
        ASSERT_TRUE(valid_body(state.body(s))) << spread;
        if (state.alive()[s] == 0) {
          ASSERT_EQ(state.body(s), BodyState{}) << spread;
        }
      }
    }
  }
}

TEST(Hard, APileComesToRestInItsRoomAndThenDoesNotMove) {
  constexpr std::uint32_t kBodies = 300;
  const auto predictor = hard(kBodies, room());
  State state = block(kBodies);
  for (int frame = 0; frame < 1500; ++frame) predictor->step(state, state, input_of(kGravity));
  const State rested = state;
  for (int frame = 0; frame < 1500; ++frame) predictor->step(state, state, input_of(kGravity));
  std::uint32_t asleep = 0;
  for (Slot s = 0; s < kBodies; ++s) {
    EXPECT_LT(moved(state, rested, s), 1500 * 0.1 * kThreshold) << s;
    asleep += state.own()[s] == 5 ? 1U : 0U;
    for (const std::size_t axis : {0U, 2U})
      EXPECT_LT(std::abs(state.p(axis)[s]), 7 * kRadius + kThreshold) << s;
    EXPECT_GT(state.p(1)[s], kRadius - kThreshold) << s;
    EXPECT_LT(state.p(1)[s], 20 * kRadius) << s;
  }
  EXPECT_GT(asleep, kBodies * 9 / 10);
}

TEST(Hard, BodiesThatSleepWakeWhenGravityTurns) {
  const auto predictor = hard(98, room());
  State state = block(98);
  for (int frame = 0; frame < 1500; ++frame) predictor->step(state, state, input_of(kGravity));
  ASSERT_GT(std::count(state.own().begin(), state.own().end(), 5), 80);
  StepInput turned = input_of({20000, -20000, 0});
  turned.gravity_before = kGravity;
  predictor->step(state, state, turned);
  EXPECT_EQ(std::count(state.own().begin(), state.own().end(), 0), 98);
}

// Three fields of 150 bodies each on a floor, in two blocks of slots.
TEST(Hard, BodiesSleepOnWhereNobodyNearMovesAndOthersAreRoused) {
  constexpr std::uint32_t kCapacity = 2 * kBlockSlots;
  ContactConstants floor = room();
  floor.planes = {floor.planes[3]};
  const auto predictor = hard(kCapacity, floor);
  State state = make_state(kCapacity);
  for (std::int32_t i = 0; i < 450; ++i) {
    const std::int32_t row = i / 10;
    const Vec3i at{(2 * (i % 10) + 40 * (row % 3)) * kRadius, kRadius, 2 * (row / 3) * kRadius};
    state.spawn(static_cast<Slot>(i) * 70, 0, 0, {at, {}});
  }
  for (int frame = 0; frame < 60; ++frame) predictor->step(state, state, input_of(kGravity));
  ASSERT_EQ(std::count(state.own().begin(), state.own().end(), 5), 450);
  state.v(0)[0] = 4 * kThreshold * 64;
  state.c(1)[449 * 70] = 77;
  const State before = state;
  State next = make_state(kCapacity);
  for (int frame = 0; frame < 4; ++frame) {
    predictor->step(state, next, input_of(kGravity));
    predictor->step(state, state, input_of(kGravity));
    ASSERT_EQ(state, next) << frame;
  }
  std::uint32_t woken = 0;
  for (Slot i = 0; i < 450; ++i) {
    const Slot s = i * 70;
    if (before.p(0)[s] > 20 * kRadius || before.p(2)[s] > 14 * kRadius) {
      EXPECT_EQ(state.body(s), before.body(s)) << i;
    }
    if (state.own()[s] != 5) ++woken;
  }
  EXPECT_GT(woken, 3U);
  EXPECT_LT(woken, 100U);
  // A change of gravity that is too small to wake them, but they do not sleep through it.
  StepInput turned = input_of(kGravity);
  turned.drive.gravity[0] = 1;
  predictor->step(state, state, turned);
  EXPECT_NE(state.c(1)[449 * 70], 77);
}

// Bodies of `hard` are balls: where they have orientations, these turn, and nothing else is different.
TEST(Hard, SpinsKeepNobodyAwake) {
  const auto predictor = hard(98, room());
  State state = block(98);
  for (int frame = 0; frame < 800; ++frame) predictor->step(state, state, input_of(kGravity));
  ASSERT_GT(std::count(state.own().begin(), state.own().end(), 5), 80);
  State turning(98, {.orientation = true});
  turning.keep_for_predictor(1);
  for (Slot s = 0; s < 98; ++s) {
    turning.spawn(s, 0, 0, {{}, {}, kNoTurn, {1 << 20, 0, -(1 << 22)}});
    for (std::size_t i = 0; i < 3; ++i) {
      turning.p(i)[s] = state.p(i)[s];
      turning.v(i)[s] = state.v(i)[s];
      turning.c(i)[s] = state.c(i)[s];
    }
    turning.own()[s] = state.own()[s];
  }
  for (int frame = 0; frame < 60; ++frame) {
    const auto hit = static_cast<Slot>(frame);
    state.v(0)[hit] = turning.v(0)[hit] = 2 * kThreshold * 64;
    predictor->step(state, state, input_of(kGravity));
    predictor->step(turning, turning, input_of(kGravity));
    for (Slot s = 0; s < 98; ++s) {
      for (std::size_t i = 0; i < 3; ++i) ASSERT_EQ(turning.p(i)[s], state.p(i)[s]) << frame << ' ' << s;
      ASSERT_EQ(turning.own()[s], state.own()[s]) << frame << ' ' << s;
    }
  }
}

TEST(Hard, ManyBodiesInOnePlaceLeaveEachOtherWithoutAnExplosion) {
  const auto predictor = hard(64, room());
  State state = make_state(64);
  for (Slot s = 0; s < 64; ++s) state.spawn(s, 0, 0, {{static_cast<std::int32_t>(s), 10 * kRadius, 0}, {}});
  for (int frame = 0; frame < 300; ++frame) {
    predictor->step(state, state, input_of({}));
    for (Slot s = 0; s < 64; ++s) {
      for (std::size_t i = 0; i < 3; ++i) ASSERT_LT(std::abs(state.v(i)[s]), 64 * kRadius) << frame;
    }
  }
}

TEST(Hard, AHeavyBodyIsPushedLessAndOneOfNoMobilityNotAtAll) {
  ContactConstants constants = constants_of(1);
  constants.types = {{kRadius, 65536}, {kRadius, 65536 / 4}, {kRadius, 0}};
  const auto predictor = hard(4, constants);
  State state = make_state(4);
  const auto collide = [&](Slot first, TypeId a, TypeId b, std::int32_t z) {
    state.spawn(first, 0, a, {{0, 1000000, z}, {640000, 0, 0}});
    state.spawn(first + 1, 0, b, {{2 * kRadius + 100, 1000000, z}, {}});
  };
  collide(0, 0, 1, 0);
  collide(2, 0, 2, 10 * kRadius);
  predictor->step(state, state, input_of({}));
  EXPECT_NEAR(state.v(0)[0], 640000 / 5, 3000);
  EXPECT_NEAR(state.v(0)[1], 640000 / 5, 3000);
  EXPECT_NEAR(state.v(0)[2], 0, 3000);
  EXPECT_EQ(state.v(0)[3], 0);
}

TEST(Hard, TakesNoMoreSlotsThanAClientHasMemoryFor) {
  const std::vector<std::int32_t> constants = write_contact_constants(room());
  EXPECT_TRUE(make_predictor("hard", 1U << 12U, constants));
  EXPECT_FALSE(make_predictor("hard", (1U << 18U) + 1, constants));
  EXPECT_FALSE(make_predictor("hard", 100, {}));
}

TEST(Hard, KeepsBodiesOutOfBoxesAndBalls) {
  const auto predictor = hard(2, constants_of(1));
  State state = make_state(2);
  state.spawn(0, 0, 0, {{200000, 90000, 0}, {0, -200000, 0}});
  state.spawn(1, 0, 0, {{-200000, 100000, 0}, {0, -200000, 0}});
  for (int frame = 0; frame < 60; ++frame) predictor->step(state, state, input_of(kGravity));
  EXPECT_NEAR(state.p(1)[0], 50000 + kRadius, kThreshold);
  EXPECT_NEAR(state.p(1)[1], 60000 + kRadius, kThreshold);
}

// A body on its own on the floor, and a heap, of which nothing moves any more.
TEST(Hard, AStepThatChangesNothingIsTheSameAsOneOfAnotherPredictor) {
  const auto kept = hard(200, room());
  State state = block(200);
  for (int frame = 0; frame < 1500; ++frame) kept->step(state, state, input_of(kGravity));
  State next = make_state(200);
  kept->step(state, next, input_of(kGravity));
  ASSERT_EQ(next, state);
  const auto expect_same = [&](const State& from, const StepInput& input) {
    State expected = make_state(200);
    State found = make_state(200);
    hard(200, room())->step(from, expected, input);
    kept->step(from, found, input);
    EXPECT_EQ(found, expected);
    kept->step(state, next, input_of(kGravity));
    EXPECT_EQ(next, state);
    kept->step(next, next, input_of(kGravity));
    EXPECT_EQ(next, state);
  };
  expect_same(state, input_of(kGravity));
  expect_same(state, input_of({0, 28000, 0}));
  State changed = state;
  changed.p(1)[17] += 1;
  expect_same(changed, input_of(kGravity));
  changed = state;
  changed.despawn(3);
  expect_same(changed, input_of(kGravity));
  changed = state;
  changed.own()[5] = 0;
  expect_same(changed, input_of(kGravity));
  StepInput rougher = input_of(kGravity);
  rougher.parameters.contacts.friction = 1;
  expect_same(state, rougher);
}

std::int32_t within_limit(std::mt19937_64& random, std::int32_t limit) {
  return vector_within(random, limit)[0];
}

struct Solved {
  std::vector<HardRow> w;
  std::vector<std::int32_t> moved_xz, moved_y;
  std::vector<HardGroup> groups;
};

// 40 waves of up to 31 contacts of 64 bodies, the last of which is the geometry. In every other wave all
// weigh the same.
Solved solve(const HardKernels& kernels, std::uint64_t seed, std::int32_t speed) {
  constexpr std::uint32_t kBodies = 64, kNobody = kBodies - 1;
  constexpr std::int32_t kMax = HardLaw::kMaxWord;
  std::mt19937_64 random(seed);
  std::vector<HardContact> contacts;
  std::vector<std::uint32_t> order;
  for (std::uint32_t wave = 0; wave < 40; ++wave) {
    std::vector<std::uint32_t> bodies(kNobody);
    for (std::uint32_t i = 0; i < kNobody; ++i) bodies[i] = i;
    std::shuffle(bodies.begin(), bodies.end(), random);
    const std::uint32_t in_wave = 17 + wave % 15;
    for (std::uint32_t i = 0; i < 2 * HardGroup::kContacts; ++i) {
      order.push_back(static_cast<std::uint32_t>(contacts.size()));
      std::array<std::int16_t, 2> share{HardLaw::kHalf, HardLaw::kHalf};
      if (i >= in_wave) {
        contacts.push_back({kNobody, kNobody, {0, HardLaw::kOne, 0}, kMax, share, 0});
        continue;
      }
      const std::uint32_t b = random() % 5 == 0 ? kNobody : bodies[2 * i + 1];
      const Vec3i n =
          random() % 9 == 0 ? Vec3i{0, 0, -HardLaw::kOne} : vector_within(random, HardLaw::kOne * 4 / 7);
      if (b == kNobody) {
        share = {kMax, 0};
      } else if (wave % 2 == 0) {
        const auto of_a = static_cast<std::int32_t>(random() % HardLaw::kWhole);
        share = {static_cast<std::int16_t>(of_a), static_cast<std::int16_t>(kMax - of_a)};
      }
      contacts.push_back({bodies[2 * i], b, n, within_limit(random, speed), share, 0});
    }
  }
  constexpr std::size_t kRows = kBodies + HardMotions::kBeyond;
  Solved solved{std::vector<HardRow>(kRows), std::vector<std::int32_t>(2 * kRows),
                std::vector<std::int32_t>(2 * kRows),
                std::vector<HardGroup>(order.size() / HardGroup::kContacts)};
  std::vector<HardRow> base(kRows), way(kRows), fall(kRows);
  for (std::uint32_t i = 0; i < kNobody; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      solved.w[i].of[k] = static_cast<std::int16_t>(within_limit(random, speed));
      fall[i].of[k] = static_cast<std::int16_t>(within_limit(random, speed / 4));
    }
  }
  kernels.put(contacts.data(), order.data(), solved.groups.data(), solved.groups.size());
  kernels.solve({50, 9600}, solved.groups.data(), solved.groups.size(),
                {solved.w.data(), base.data(), way.data(), solved.moved_xz.data(), solved.moved_y.data(),
                 fall.data(), kBodies});
  return solved;
}

TEST(HardKernels, GiveTheSameBitsOnEveryMachine) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const std::int32_t speed = seed % 2 == 0 ? 1000 : HardLaw::kMaxStart;
    const Solved portable = solve(portable_hard_kernels(), seed, speed);
    const Solved fastest = solve(seed % 4 < 2 ? fastest_hard_kernels() : hard_one_by_one(), seed, speed);
    for (std::size_t i = 0; i < portable.w.size(); ++i)
      EXPECT_EQ(fastest.w[i].of, portable.w[i].of) << seed << ' ' << i;
    EXPECT_EQ(fastest.moved_xz, portable.moved_xz) << seed;
    EXPECT_EQ(fastest.moved_y, portable.moved_y) << seed;
    bool any = false;
    int alike = 0;
    for (std::size_t i = 0; i < portable.groups.size(); ++i) {
      for (std::size_t k = 0; k < HardGroup::kContacts; ++k) {
        EXPECT_EQ(fastest.groups[i].push[k], portable.groups[i].push[k]);
        EXPECT_EQ(fastest.groups[i].slide1[k], portable.groups[i].slide1[k]);
        EXPECT_EQ(fastest.groups[i].slide2[k], portable.groups[i].slide2[k]);
        any |= portable.groups[i].push[k] != 0;
      }
      alike += portable.groups[i].alike ? 1 : 0;
      EXPECT_EQ(fastest.groups[i].alike, portable.groups[i].alike);
    }
    EXPECT_TRUE(any);
    EXPECT_GT(alike, 0);
    EXPECT_LT(alike, 40);
    EXPECT_EQ(portable.w[63].of, HardRow{}.of);
  }
}

// Pairs in any places: touching, in one place, far apart, as far apart as places can be.
TEST(HardKernels, FindTheSameContactsOnEveryMachine) {
  constexpr std::uint32_t kBodies = 40, kBeyond = 8;
  std::size_t all = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::int32_t radius = std::int32_t{1} << (2 + seed % 23);
    const std::int32_t spread =
        seed % 10 == 9 ? kPositionLimit : radius * static_cast<std::int32_t>(seed % 4);
    const std::int32_t speed = seed % 3 == 0 ? kVelocityLimit : 4 * radius;
    std::vector<ContactBody> bodies(kBodies);
    std::vector<std::int32_t> mobility(kBodies);
    for (Slot s = 0; s < kBodies; ++s) {
      const bool at_limit = seed % 10 == 9 && s % 3 == 0;
      const std::int32_t limit = s % 2 == 0 ? kPositionLimit : -kPositionLimit;
      bodies[s] = {at_limit ? Vec3i{limit, limit, limit} : vector_within(random, spread + 1),
                   1 + within_limit(random, radius / 2) + radius / 2, vector_within(random, speed), s};
      mobility[s] = random() % 4 == 0 ? 0 : 65536;
    }
    const HardReach reach{static_cast<std::uint32_t>(seed % 27), 1 + radius / 10, 12 * std::int64_t{radius},
                          0, radius};
    const auto found_by = [&](HardMeet meet) {
      std::vector<std::uint32_t> first, second;
      for (std::uint32_t a = 0; a < kBodies; ++a) {
        for (std::uint32_t b = a + 1; b < kBodies; ++b) {
          first.push_back(a);
          second.push_back(b);
        }
      }
      const auto count = static_cast<std::uint32_t>(first.size());
      first.resize(count + kBeyond, 1000000);
      second.resize(count + kBeyond, 1000000);
      std::vector<HardContact> found(count + kBeyond);
      found.resize(meet(reach, {bodies.data(), mobility.data(), true}, {first.data(), second.data(), count},
                        found.data()));
      return found;
    };
    const std::vector<HardContact> portable = found_by(portable_hard_meet());
    const std::vector<HardContact> fastest = found_by(fastest_hard_meet());
    ASSERT_EQ(fastest.size(), portable.size());
    for (std::size_t i = 0; i < portable.size(); ++i) {
      const HardContact& p = portable[i];
      const HardContact& f = fastest[i];
      ASSERT_EQ(std::tie(f.a, f.b, f.n, f.gap, f.run), std::tie(p.a, p.b, p.n, p.gap, p.run)) << i;
    }
    all += portable.size();
  }
  EXPECT_GT(all, 1000U);
}

// Where the distance is a whole number, the inverse of its root is most easily computed a little too large.
TEST(HardKernels, FindTheSameContactsAtWholeDistances) {
  constexpr std::uint32_t kAtOnce = 1024, kBeyond = 8;
  for (std::int32_t first = 700; first < 200000; first += std::int32_t{kAtOnce}) {
    std::vector<ContactBody> bodies(2 * kAtOnce);
    std::vector<std::uint32_t> a(kAtOnce + kBeyond), b(kAtOnce + kBeyond);
    for (std::uint32_t i = 0; i < kAtOnce; ++i) {
      const std::int32_t far = first + static_cast<std::int32_t>(i);
      bodies[i] = {{}, far / 2, {}, i};
      bodies[kAtOnce + i] = {{far, 0, 0}, far / 2, {}, i};
      a[i] = i;
      b[i] = kAtOnce + i;
    }
    const std::vector<std::int32_t> mobility(bodies.size(), 65536);
    const HardReach reach{0, 1 + first / 10, 0, 0, first};
    const auto found_by = [&](HardMeet meet) {
      std::vector<HardContact> found(kAtOnce + kBeyond);
      found.resize(
          meet(reach, {bodies.data(), mobility.data(), false}, {a.data(), b.data(), kAtOnce}, found.data()));
      return found;
    };
    const std::vector<HardContact> portable = found_by(portable_hard_meet());
    const std::vector<HardContact> fastest = found_by(fastest_hard_meet());
    ASSERT_EQ(portable.size(), kAtOnce);
    ASSERT_EQ(fastest.size(), kAtOnce);
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      EXPECT_EQ(fastest[i].n, portable[i].n) << first << ' ' << i;
      EXPECT_EQ(fastest[i].gap, portable[i].gap) << first << ' ' << i;
    }
  }
}

// Two tangents at right angles to n, as PROTOCOL.md computes them one by one.
TEST(HardKernels, ComputeTangentsAsTheProtocolDoes) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 2000; ++round) {
    Vec3i n = vector_within(random, HardLaw::kOne);
    if (round % 5 == 0) n[2] = round % 2 == 0 ? HardLaw::kOne : -HardLaw::kOne;
    std::vector<HardContact> contacts(1, {0, 1, n, 5, {7, 8}, 0});
    const std::vector<std::uint32_t> order(HardGroup::kContacts, 0);
    HardGroup group;
    (round % 2 == 0 ? fastest_hard_kernels() : portable_hard_kernels())
        .put(contacts.data(), order.data(), &group, 1);
    const std::int32_t sign = n[2] < 0 ? -1 : 1;
    const std::int32_t inverse = (1 << 24) / (HardLaw::kOne + sign * n[2]);
    const std::int32_t x = (n[0] * inverse + 2048) >> 12;
    const std::int32_t y = (n[1] * inverse + 2048) >> 12;
    const std::int32_t xy = (x * n[1] + 2048) >> 12;
    for (std::size_t k = 0; k < HardGroup::kContacts; ++k) {
      const auto word = [](std::int32_t component) { return std::min(8 * component, HardLaw::kMaxWord); };
      EXPECT_EQ(group.t1x[k], word(HardLaw::kOne - ((n[0] * x + 2048) >> 12)));
      EXPECT_EQ(group.t1y[k], word(-sign * xy));
      EXPECT_EQ(group.t2y[k], word(HardLaw::kOne - ((n[1] * y + 2048) >> 12)));
      EXPECT_EQ(group.nz[k], std::max(word(n[2]), -HardLaw::kMaxWord));
      EXPECT_EQ(group.b[k], sizeof(HardRow));
      EXPECT_EQ(group.gap[k], 5);
      EXPECT_EQ(group.share_a[k], 7);
      EXPECT_EQ(group.share_b[k], 8);
      EXPECT_FALSE(group.alike);
    }
  }
}

}  // namespace
}  // namespace tandem
