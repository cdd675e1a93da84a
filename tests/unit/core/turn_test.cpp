#include "sdk/core/lattice/turn.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "tests/property/random.hpp"
#include "tests/unit/core/contact_world.hpp"

namespace tandem {
namespace {

using synthetic::any_quaternion;
using synthetic::any_spin;
using synthetic::Random;

constexpr std::int32_t kOne = kQuaternionOne;
constexpr double kPi = 3.14159265358979323846;
constexpr std::uint64_t kSeed = 20261122;

// x, y, z, w.
using Real4 = std::array<double, 4>;

Real4 real(const Quaternion& q) {
  Real4 r{};
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = std::ldexp(q[i], -30);
  return r;
}

Real4 product(const Real4& a, const Real4& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

double norm(const Real4& q) { return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]); }

// The angle of the turn that leads from one to the other.
double angle_rad(const Real4& a, const Real4& b) {
  const Real4 between = product(a, {-b[0], -b[1], -b[2], b[3]});
  return 2 * std::atan2(std::hypot(between[0], between[1], between[2]), std::abs(between[3]));
}

Real4 turned_exactly(const Quaternion& q, const Spin& spin) {
  const double x = std::ldexp(spin[0], -28), y = std::ldexp(spin[1], -28), z = std::ldexp(spin[2], -28);
  const double angle = std::hypot(x, y, z);
  const double s = angle == 0 ? 0.5 : std::sin(angle / 2) / angle;
  return product({x * s, y * s, z * s, std::cos(angle / 2)}, real(q));
}

// Where the body's z axis points to.
std::array<double, 3> z_axis(const Quaternion& of) {
  const Real4 q = real(of);
  const Real4 v = product(product(q, {0, 0, 1, 0}), {-q[0], -q[1], -q[2], q[3]});
  return {v[0], v[1], v[2]};
}

constexpr auto kQuarter = static_cast<std::int32_t>(kPi / 2 * (1 << 28));

TEST(Turn, IsTheOneOfFloatingPoint) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Quaternion q = any_quaternion(random);
    const Spin spin = any_spin(random);
    const Quaternion after = turned(q, spin);
    ASSERT_LE(angle_rad(real(after), turned_exactly(q, spin)), 1e-5) << "turn " << i;
    ASSERT_NEAR(norm(real(after)), 1, 1e-8) << "turn " << i;
    ASSERT_TRUE(valid_quaternion(after));
  }
}

TEST(Turn, KeepsTheNormForAsLongAsABodyTurns) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  for (int body = 0; body < 20; ++body) {
    Quaternion q = any_quaternion(random);
    const Spin spin = any_spin(random);
    for (int frame = 0; frame < 10000; ++frame) {
      q = turned(q, spin);
      ASSERT_NEAR(norm(real(q)), 1, 1e-8) << "body " << body << ", frame " << frame;
    }
  }
}

TEST(Turn, BringsAnInexactNormBackToOne) {
  const auto scaled = [](double by) {
    Quaternion q{};
    for (std::int32_t& a : q) a = static_cast<std::int32_t>(std::lround(by * kOne / 2));
    return q;
  };
  for (const double by : {1 + 0.00048, 1 - 0.00048}) {
    Quaternion q = scaled(by);
    ASSERT_TRUE(valid_quaternion(q));
    q = turned(q, {});
    EXPECT_NEAR(norm(real(q)), 1, 1e-6);
    EXPECT_NEAR(norm(real(turned(q, {}))), 1, 1e-8);
  }
}

TEST(Turn, ByNothingIsNone) {
  EXPECT_EQ(turned(kNoTurn, {}), kNoTurn);
  Random random(kSeed);
  for (int i = 0; i < 100; ++i) {
    const Quaternion q = turned(any_quaternion(random), {});
    const Quaternion after = turned(q, {});
    for (std::size_t k = 0; k < q.size(); ++k) EXPECT_NEAR(after[k], q[k], 2);
  }
}

TEST(Turn, IsAboutTheAxesOfTheWorld) {
  // About x, z goes to -y, where a turn about y leaves it; about y first, z goes to x, and stays.
  const auto x_then_y = z_axis(turned(turned(kNoTurn, {kQuarter, 0, 0}), {0, kQuarter, 0}));
  EXPECT_NEAR(x_then_y[1], -1, 1e-6);
  const auto y_then_x = z_axis(turned(turned(kNoTurn, {0, kQuarter, 0}), {kQuarter, 0, 0}));
  EXPECT_NEAR(y_then_x[0], 1, 1e-6);
}

TEST(Turn, BackAndForthEndsWhereItBegan) {
  Random random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const Quaternion q = any_quaternion(random);
    const Spin spin = any_spin(random);
    const Quaternion back = turned(turned(q, spin), {-spin[0], -spin[1], -spin[2]});
    ASSERT_LE(angle_rad(real(back), real(q)), 1e-8);
  }
}

TEST(Turn, TwoSignsOfAQuaternionStayTheSameTurn) {
  Random random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const Quaternion q = any_quaternion(random);
    const Spin spin = any_spin(random);
    const Quaternion a = turned(q, spin), b = turned({-q[0], -q[1], -q[2], -q[3]}, spin);
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k], -b[k], 2);
  }
}

TEST(Quaternion, OfAnotherNormIsNone) {
  constexpr std::int32_t kHalf = kOne / 2;
  EXPECT_TRUE(valid_quaternion(kNoTurn));
  EXPECT_TRUE(valid_quaternion({0, -kOne, 0, 0}));
  EXPECT_TRUE(valid_quaternion({kHalf, -kHalf, kHalf, -kHalf}));
  EXPECT_FALSE(valid_quaternion({}));
  EXPECT_FALSE(valid_quaternion({0, 0, 0, kOne + 1})) << "a component";
  EXPECT_FALSE(valid_quaternion({INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN}));
  EXPECT_FALSE(valid_quaternion({kOne, kOne, kOne, kOne}));
  EXPECT_FALSE(valid_quaternion({0, 0, 0, kHalf}));
  // The most and the least that is allowed: a sum of squares of 2^58 +- 2^48.
  EXPECT_TRUE(valid_quaternion({537132992, 537132992, 537132992, 537132992}));
  EXPECT_FALSE(valid_quaternion({537132992, 537132992, 537132992, 537132993}));
  EXPECT_TRUE(valid_quaternion({0, 0, 1073217408, 0}));
  EXPECT_FALSE(valid_quaternion({0, 0, 1073217407, 0}));
}

TEST(Spin, IsAtMostTwoRadiansLong) {
  constexpr std::int32_t kMax = kSpinLimit;
  EXPECT_TRUE(valid_spin({}));
  EXPECT_TRUE(valid_spin({0, 0, -kMax}));
  EXPECT_TRUE(valid_spin({309959000, -309959000, 309959000}));
  EXPECT_FALSE(valid_spin({0, kMax + 1, 0}));
  EXPECT_FALSE(valid_spin({kMax, 1, 0})) << "as a vector";
  EXPECT_FALSE(valid_spin({310000000, 310000000, 310000000}));
  EXPECT_FALSE(valid_spin({INT32_MIN, INT32_MIN, INT32_MIN}));
}

TEST(Spin, ALongOneIsHalvedUntilItIsValid) {
  EXPECT_EQ(limited_spin({5, -7, kSpinLimit - 1}), (Spin{5, -7, kSpinLimit - 1}));
  EXPECT_EQ(limited_spin({2LL * kSpinLimit, 0, 0}), (Spin{kSpinLimit, 0, 0}));
  constexpr std::int64_t kHuge = (std::int64_t{1} << 62) - 1;
  const Spin spin = limited_spin({kHuge, -kHuge, kHuge});
  EXPECT_TRUE(valid_spin(spin));
  EXPECT_GT(spin[0], kSpinLimit / 4);
  EXPECT_NEAR(spin[1], -spin[0], 1);
}

State turning_state(Random& random, std::uint32_t capacity) {
  State state(capacity, {.orientation = true});
  for (Slot slot = 0; slot < capacity; ++slot) {
    if (random.one_in(5)) continue;
    BodyState body{{random.even(1 << 18), random.even(1 << 18), random.even(1 << 18)},
                   {random.even(1 << 16), random.even(1 << 16), random.even(1 << 16)}};
    body.q = any_quaternion(random);
    body.w = any_spin(random);
    state.spawn(slot, 0, 0, body);
  }
  return state;
}

// Puts some bodies to rest. The c of one of them does not hold it up, so that it wakes in the step.
void put_to_rest(State& state, const Drive& drive) {
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] == 0 || slot % 3 != 0) continue;
    state.rest()[slot] = 1;
    for (std::size_t i = 0; i < 3; ++i) state.c(i)[slot] = slot == 30 ? 0 : -drive.gravity[i];
  }
}

std::unique_ptr<Predictor> tier(std::string_view name, std::uint32_t capacity) {
  return name == "ballistic" ? *make_predictor(name, capacity, {})
                             : predictor_of(name, capacity, constants_of(2));
}

class PredictedTurn : public testing::TestWithParam<const char*> {};

TEST_P(PredictedTurn, IsTakenByEveryBodyThatDoesNotRest) {
  constexpr std::uint32_t kCapacity = 101;  // no multiple of what a vector unit takes at once
  const StepInput input{{{0, -3000, 0}, 200}, {}};
  Random random(kSeed);
  State from = turning_state(random, kCapacity);
  put_to_rest(from, input.drive);
  State with(kCapacity, {.orientation = true}), without(kCapacity), plain(kCapacity);
  for (Slot slot = 0; slot < kCapacity; ++slot) {
    if (from.alive()[slot] == 0) continue;
    plain.spawn(slot, 0, 0, from.body(slot));
    plain.rest()[slot] = from.rest()[slot];
    for (std::size_t i = 0; i < 3; ++i) plain.c(i)[slot] = from.c(i)[slot];
  }
  const auto predictor = tier(GetParam(), kCapacity);
  for (State* const state : {&from, &with, &without, &plain})
    state->keep_for_predictor(predictor->own_bytes());
  predictor->step(from, with, input);
  predictor->step(plain, without, input);
  for (Slot slot = 0; slot < kCapacity; ++slot) {
    SCOPED_TRACE(slot);
    EXPECT_EQ(with.rest()[slot], without.rest()[slot]);
    EXPECT_EQ(with.body(slot).p, without.body(slot).p) << "positions know nothing of orientations";
    EXPECT_EQ(with.body(slot).v, without.body(slot).v);
    EXPECT_EQ(with.body(slot).w, from.body(slot).w);
    const Quaternion expected =
        with.rest()[slot] != 0 ? from.quaternion(slot) : turned(from.quaternion(slot), from.body(slot).w);
    EXPECT_EQ(with.quaternion(slot), expected);
    if (from.alive()[slot] == 0) {
      EXPECT_EQ(with.quaternion(slot), Quaternion{});
    }
  }
  State in_place = from;
  predictor->step(in_place, in_place, input);
  EXPECT_EQ(in_place, with);
}

TEST_P(PredictedTurn, OfSomeSlotsIsThatOfAll) {
  constexpr std::uint32_t kCapacity = 40;
  const StepInput input{{{0, -3000, 0}, 200}, {}};
  Random random(7);
  State from = turning_state(random, kCapacity);
  put_to_rest(from, input.drive);
  const auto predictor = tier(GetParam(), kCapacity);
  State all(kCapacity, {.orientation = true});
  for (State* const state : {&from, &all}) state->keep_for_predictor(predictor->own_bytes());
  predictor->step(from, all, input);
  State some = all;
  const std::vector<Slot> slots{0, 3, 5, 30, 39};
  for (const Slot slot : slots) some.despawn(slot);
  for (const Slot slot : slots) some.alive()[slot] = from.alive()[slot];
  predictor->step_slots(from, some, input, slots);
  EXPECT_EQ(some, all);
}

INSTANTIATE_TEST_SUITE_P(Tiers, PredictedTurn, testing::Values("ballistic", "contact", "field", "hard"),
                         [](const auto& of) { return std::string(of.param); });

TEST(State, WithOrientationsADeadSlotIsZeroInEveryColumn) {
  const Groups turns{.orientation = true};
  State state(3, turns);
  EXPECT_EQ(state.groups(), turns);
  state.spawn(1, 7, 2, {{10, 20, 30}, {1, 2, 3}, {0, kOne, 0, 0}, {4, 5, 6}});
  EXPECT_EQ(state.body(1), (BodyState{{10, 20, 30}, {1, 2, 3}, {0, kOne, 0, 0}, {4, 5, 6}}));
  state.despawn(1);
  EXPECT_EQ(state, State(3, turns));
  EXPECT_EQ(state.quaternion(1), Quaternion{});
}

TEST(State, WithoutOrientationsABodyIsNotTurned) {
  State state(1);
  state.spawn(0, 0, 0, {{1, 2, 3}, {4, 5, 6}, {0, kOne, 0, 0}, {7, 8, 9}});
  EXPECT_EQ(state.body(0), (BodyState{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_TRUE(state.q(0).empty());
  EXPECT_TRUE(state.w(0).empty());
  EXPECT_NE(state, State(1, {.orientation = true}));
}

TEST(StateHasher, OrientationsAreALeafOfTheirOwn) {
  State state(2, {.orientation = true});
  state.spawn(1, 0, 0, {{}, {}, {1, -1, 0, kOne}, {2, 0, -2}});
  const std::array<std::uint8_t, 10> common{0, 1};  // alive; reuse, type and rest are zero
  const std::array<std::int32_t, 18> position{};    // p, v, c
  const std::array<std::int32_t, 14> orientation{0, 1, 0, -1, 0, 0, 0, kOne,  // q
                                                 0, 2, 0, 0,  0, -2};         // w
  const auto leaf = [](const auto& columns, std::size_t bytes) {
    return hash_bytes(std::as_bytes(std::span(columns)).first(bytes));
  };
  const std::array leaves{leaf(common, 10), leaf(position, 72), leaf(orientation, 56)};
  const std::uint64_t all = hash_bytes(std::as_bytes(std::span(leaves)));
  EXPECT_EQ(StateHasher().hash(state), hash_bytes(std::as_bytes(std::span(&all, 1))));
}

TEST(StateHasher, EveryColumnOfAnOrientationCountsInEveryBlock) {
  State state(kBlockSlots + 3, {.orientation = true});
  const Slot slot = kBlockSlots + 1;
  state.spawn(slot, 0, 0, {});
  StateHasher hasher;
  const std::uint64_t before = hasher.hash(state);
  for (std::size_t i = 0; i < kQuaternionChannels; ++i) {
    ++state.q(i)[slot];
    EXPECT_NE(hasher.hash(state), before) << "q " << i;
    --state.q(i)[slot];
  }
  for (std::size_t i = 0; i < kSpinChannels; ++i) {
    ++state.w(i)[slot];
    EXPECT_NE(hasher.hash(state), before) << "w " << i;
    --state.w(i)[slot];
  }
  EXPECT_EQ(hasher.hash(state), before);
}

}  // namespace
}  // namespace tandem
