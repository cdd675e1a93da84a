#include <gtest/gtest.h>

#include <random>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/predict/contact_constants.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {
namespace {

constexpr std::int32_t kRadius = 20000;

ContactConstants constants_of(std::int32_t substeps) {
  ContactConstants constants;
  constants.substeps = substeps;
  constants.pair = {3640 / substeps, 410 / substeps, 410 / substeps};
  constants.wall = constants.pair;
  constants.types = {{kRadius, 65536}, {kRadius / 2, 131072}};
  constants.planes = {{{0, ContactConstants::kOne, 0}, 0}};
  constants.boxes = {
      {{200000, 0, 0},
       {50000, 50000, 50000},
       {{{ContactConstants::kOne, 0, 0}, {0, ContactConstants::kOne, 0}, {0, 0, ContactConstants::kOne}}}}};
  constants.balls = {{{-200000, 0, 0}, 60000}};
  return constants;
}

std::unique_ptr<Predictor> field(std::uint32_t capacity, const ContactConstants& constants) {
  return *make_predictor("field", capacity, write_contact_constants(constants));
}

Vec3i vector_within(std::mt19937_64& random, std::int32_t limit) {
  Vec3i v{};
  for (std::int32_t& x : v)
    x = static_cast<std::int32_t>(random() % (2 * static_cast<std::uint64_t>(limit) + 1)) - limit;
  return v;
}

State bodies_within(std::mt19937_64& random, std::uint32_t capacity, std::int32_t p, std::int32_t v) {
  State state(capacity);
  for (Slot s = 0; s < capacity; ++s) {
    if (random() % 7 == 0) continue;
    const TypeId type = static_cast<TypeId>(random() % 3);  // one more than the constants know
    state.spawn(s, 0, type, {vector_within(random, p), vector_within(random, v)});
    for (std::size_t i = 0; i < 3; ++i) state.c(i)[s] = vector_within(random, v)[i];
  }
  return state;
}

const Drive kFalling{{0, -3000, 0}, 200, 800};

TEST(Field, InPlaceEqualsApartForAnyState) {
  constexpr std::uint64_t kSeed = 71;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  for (const std::int32_t reach : {0, 10, kRadius, 20 * kRadius, kPositionLimit}) {
    for (const std::int32_t speed : {0, 100000, kVelocityLimit}) {
      for (const std::int32_t substeps : {1, 2, 16}) {
        const auto predictor = field(300, constants_of(substeps));
        State state = bodies_within(random, 300, reach, speed);
        State apart(300);
        for (int frame = 0; frame < 4; ++frame) {
          predictor->step(state, apart, kFalling);
          predictor->step(state, state, kFalling);
          ASSERT_EQ(state, apart);
        }
        for (Slot s = 0; s < 300; ++s) {
          for (std::size_t i = 0; i < 3; ++i) {
            ASSERT_LE(std::abs(state.p(i)[s]), kPositionLimit);
            ASSERT_LE(std::abs(state.v(i)[s]), kVelocityLimit);
            ASSERT_TRUE(state.alive()[s] != 0 || (state.p(i)[s] | state.v(i)[s] | state.c(i)[s]) == 0);
          }
        }
      }
    }
  }
}

TEST(Field, ExtremeConstantsMeetExtremeStates) {
  constexpr std::uint64_t kSeed = 72;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  ContactConstants constants = constants_of(16);
  constants.pair = constants.wall = {ContactMaterial::kMostSpring, ContactMaterial::kMostDamping,
                                     ContactMaterial::kMostDamping};
  const Vec3i ones{ContactConstants::kOne, ContactConstants::kOne, ContactConstants::kOne};
  const Vec3i corner{kPositionLimit, -kPositionLimit, kPositionLimit};
  constants.planes = {{ones, kPositionLimit}, {ones, -kPositionLimit}};
  constants.boxes = {{corner, {kPositionLimit, kPositionLimit, kPositionLimit}, {ones, ones, ones}}};
  constants.balls = {{corner, kPositionLimit}, {{}, 0}};
  for (const std::int32_t radius : {1, 2, 100, ContactConstants::kMostRadius}) {
    constants.types = {{radius, ContactConstants::kMostMobility}};
    const auto predictor = field(200, constants);
    for (const std::int32_t reach : {0, 1, kPositionLimit}) {
      State state = bodies_within(random, 200, reach, kVelocityLimit);
      for (int frame = 0; frame < 5; ++frame) predictor->step(state, state, kFalling);
      EXPECT_GT(state.alive_count(), 0U);
    }
  }
}

TEST(Field, IsContactInAWorldOfOneSubstep) {
  constexpr std::uint64_t kSeed = 73;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const auto contact = *make_predictor("contact", 300, write_contact_constants(constants_of(1)));
  const auto one_step = field(300, constants_of(1));
  EXPECT_EQ(one_step->name(), "contact");
  EXPECT_EQ(field(300, constants_of(2))->name(), "field");
  State state = bodies_within(random, 300, 5 * kRadius, 100000);
  State other = state;
  for (int frame = 0; frame < 20; ++frame) {
    contact->step(state, state, kFalling);
    one_step->step(other, other, kFalling);
    ASSERT_EQ(state, other);
  }
}

// Largest speed of a pile that had 5,000 frames to come to rest, in radii a frame.
double speed_at_rest(std::int32_t substeps, std::int32_t spring) {
  ContactConstants constants = constants_of(substeps);
  constants.pair.spring = constants.wall.spring = spring;
  constants.boxes.clear();
  constants.balls.clear();
  constexpr std::uint32_t kBodies = 512;
  State state(kBodies);
  for (Slot s = 0; s < kBodies; ++s) {
    const auto i = static_cast<std::int32_t>(s);
    const auto at = [](std::int32_t cell) { return cell * kRadius * 39 / 20; };
    state.spawn(s, 0, 0, {{at(i % 8), kRadius + at(i / 64), at(i / 8 % 8)}, {}});
  }
  const auto predictor = field(kBodies, constants);
  for (int frame = 0; frame < 5000; ++frame) predictor->step(state, state, kFalling);
  std::int32_t fastest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::int32_t v : state.v(i)) fastest = std::max(fastest, std::abs(v));
  }
  return fastest / 64.0 / kRadius;
}

TEST(Field, APileComesToRestHoweverStiffAndDividedTheWorldIs) {
  for (const std::int32_t substeps : {2, 16}) {
    for (const std::int32_t spring : {1000, 65536})
      EXPECT_LT(speed_at_rest(substeps, spring), 0.005) << substeps << " sub-steps, " << spring;
  }
}

TEST(Field, TwoBodiesPartWithEqualAndOppositeSpeed) {
  ContactConstants constants = constants_of(1);
  constants.planes.clear();
  const auto predictor = field(2, constants);
  for (const double distance : {1.5, 1.7, 1.9}) {
    State state(2);
    state.spawn(0, 0, 0, {{0, 0, 0}, {}});
    state.spawn(1, 0, 0, {{static_cast<std::int32_t>(distance * kRadius), 0, 0}, {}});
    predictor->step(state, state, {});
    EXPECT_LT(state.v(0)[0], 0);
    EXPECT_NEAR(state.v(0)[0], -state.v(0)[1], 64);
    const double expected = 64.0 * (2 - distance) * kRadius * 3640 / 16384;
    EXPECT_NEAR(state.v(0)[1], expected, expected / 50 + 64) << distance;
  }
}

TEST(Field, DeepOverlapsPartToo) {
  ContactConstants constants = constants_of(1);
  constants.planes.clear();
  const auto predictor = field(2, constants);
  for (std::int32_t distance = kRadius / 100; distance < 2 * kRadius; distance += kRadius / 100) {
    State state(2);
    state.spawn(0, 0, 0, {{0, 0, 0}, {}});
    state.spawn(1, 0, 0, {{0, distance, 0}, {}});
    predictor->step(state, state, {});
    ASSERT_GE(state.v(1)[1], distance < 19 * kRadius / 10 ? 1 : 0) << distance;
  }
}

TEST(Field, BodiesApartMoveAsBallistic) {
  std::mt19937_64 random(74);
  ContactConstants constants = constants_of(1);
  constants.planes.clear();
  constants.boxes.clear();
  constants.balls.clear();
  constexpr std::uint32_t kCapacity = 20000;
  State state(kCapacity);
  for (Slot s = 0; s < 64; ++s) {
    const auto x = static_cast<std::int32_t>(s) * 3 * kRadius;  // more than once round the torus
    state.spawn(s, 0, 0, {{x, 0, -x}, vector_within(random, 100000)});
    state.c(1)[s] = 77;
  }
  State expected = state;
  const auto ballistic = *make_predictor("ballistic", kCapacity, {});
  field(kCapacity, constants)->step(state, state, kFalling);
  ballistic->step(expected, expected, kFalling);
  EXPECT_EQ(state, expected);
}

TEST(Field, ABodyOnThePlaneComesToRest) {
  for (const std::int32_t substeps : {1, 2}) {
    const auto predictor = field(1, constants_of(substeps));
    State state(1);
    state.spawn(0, 0, 0, {{0, 3 * kRadius, 0}, {}});
    for (int frame = 0; frame < 3000; ++frame) predictor->step(state, state, kFalling);
    EXPECT_NEAR(state.p(1)[0], kRadius, kRadius / 20);
    EXPECT_LT(std::abs(state.v(1)[0]), 1000);  // 16 lattice units a frame
  }
}

TEST(Field, AMixedRunKeepsItsHash) {
  const auto predictor = field(200, constants_of(2));
  State state(200);
  std::uint32_t x = 1;
  const auto next = [&x](std::int32_t limit) {
    x = x * 1664525U + 1013904223U;
    return static_cast<std::int32_t>((x >> 8U) % (2 * static_cast<std::uint32_t>(limit))) - limit;
  };
  for (Slot s = 0; s < 200; ++s) {
    const Vec3i p{next(8 * kRadius), next(3 * kRadius) + 4 * kRadius, next(4 * kRadius)};
    state.spawn(s, 0, static_cast<TypeId>(s % 2), {p, {next(99999), next(99999), next(99999)}});
  }
  for (int frame = 0; frame < 50; ++frame) predictor->step(state, state, kFalling);
  StateHasher hasher;
  EXPECT_EQ(to_hex(hasher.hash(state, {})), "cc81d67cfaebc15b");
}

TEST(Field, BadConstantsAreRefused) {
  const auto good = write_contact_constants(constants_of(2));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(make_predictor("field", 10, std::span(good).first(size)));
  EXPECT_TRUE(make_predictor("field", 10, good));
  EXPECT_FALSE(make_predictor("field", 0, good));
  EXPECT_FALSE(make_predictor("field", kMaxCapacity + 1, good));
}

}  // namespace
}  // namespace tandem
