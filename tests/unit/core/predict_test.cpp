#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem {
namespace {

// idl/PROTOCOL.md, "Predicted step", word by word in 64 bits.
void reference_step(State& s, const StepInput& input) {
  const auto share = [](std::int64_t x, std::int64_t k) { return (x * k + (1 << 15)) >> 16; };
  const auto clamp = [](std::int64_t x, std::int64_t limit) {
    return static_cast<std::int32_t>(std::clamp(x, -limit, limit));
  };
  for (Slot slot = 0; slot < s.capacity(); ++slot) {
    if (s.alive()[slot] == 0) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      if (s.c(i)[slot] + input.drive.gravity[i] != 0) s.rest()[slot] = 0;
    }
    if (s.rest()[slot] != 0) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      std::int64_t v = s.v(i)[slot];
      std::int64_t c = s.c(i)[slot];
      v += input.drive.gravity[i] + c;
      c -= share(c, input.parameters.decay);
      v -= share(v, input.drive.damping);
      s.v(i)[slot] = clamp(v, kVelocityLimit);
      s.c(i)[slot] = clamp(c, kVelocityLimit);
      s.p(i)[slot] =
          clamp(std::int64_t{s.p(i)[slot]} + ((std::int64_t{s.v(i)[slot]} + 32) >> 6), kPositionLimit);
    }
  }
}

State random_state(std::mt19937_64& random, std::uint32_t capacity) {
  State s(capacity);
  const auto value = [&random](std::int32_t limit) {
    // Every magnitude, the limits among them.
    const auto shift = random() % 31;
    const std::int64_t x = static_cast<std::int64_t>(random() >> 32U) % (2 * std::int64_t{limit} + 1) - limit;
    return static_cast<std::int32_t>(x >> shift);
  };
  for (Slot slot = 0; slot < capacity; ++slot) {
    if (random() % 5 == 0) continue;
    s.spawn(slot, static_cast<std::uint8_t>(random()), 0, {});
    for (std::size_t i = 0; i < 3; ++i) {
      s.p(i)[slot] = value(kPositionLimit);
      s.v(i)[slot] = value(kVelocityLimit);
      s.c(i)[slot] = value(kVelocityLimit);
    }
    s.rest()[slot] = static_cast<std::uint8_t>(random() % 2);
  }
  return s;
}

// Some bodies get a c that holds them up under the drive: those of them that are at rest stay there.
void hold_up_some(std::mt19937_64& random, const Drive& drive, State& s) {
  for (Slot slot = 0; slot < s.capacity(); ++slot) {
    if (s.alive()[slot] == 0 || random() % 2 == 0) continue;
    for (std::size_t i = 0; i < 3; ++i) s.c(i)[slot] = -drive.gravity[i];
  }
}

StepInput random_input(std::mt19937_64& random) {
  const auto g = [&random] { return static_cast<std::int32_t>(random() % (1U << 29U)) - kVelocityLimit; };
  const auto share = [&random] { return static_cast<std::uint16_t>(random()); };
  return {{{g(), g(), g()}, share()}, {share()}};
}

TEST(Ballistic, EqualsThePublishedFormulaForAnyState) {
  constexpr std::uint64_t kSeed = 20261120;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  Ballistic predictor;
  for (int round = 0; round < 50; ++round) {
    State state = random_state(random, 300);
    const StepInput input = random_input(random);
    hold_up_some(random, input.drive, state);
    State expected = state;
    State stepped(300);
    stepped.rest()[0] = 1;
    predictor.step(state, stepped, input);
    reference_step(expected, input);
    ASSERT_EQ(stepped, expected) << "round " << round;
    predictor.step(state, state, input);
    ASSERT_EQ(state, expected) << "in place, round " << round;
  }
}

TEST(Ballistic, SteppingSlotsEqualsSteppingAll) {
  std::mt19937_64 random(7);
  Ballistic predictor;
  State from = random_state(random, 100);
  const StepInput input = random_input(random);
  hold_up_some(random, input.drive, from);
  State all(100);
  predictor.step(from, all, input);
  State some = all;
  const std::vector<Slot> slots{0, 3, 4, 99};
  for (const Slot slot : slots) some.despawn(slot);
  predictor.step_slots(from, some, input, slots);
  EXPECT_EQ(some, all);
}

TEST(Ballistic, FreeFallFollowsTheParabola) {
  Ballistic predictor;
  State state(1);
  state.spawn(0, 0, 0, {});
  StepInput input;
  input.drive.gravity = {0, -640, 0};  // 10 units per frame^2
  for (int frame = 0; frame < 20; ++frame) predictor.step(state, state, input);
  EXPECT_EQ(state.p(1)[0], -10 * 20 * 21 / 2);  // semi-implicit Euler: g n(n+1)/2
  EXPECT_EQ(state.v(1)[0], -640 * 20);
}

TEST(Predictors, EachIsMadeUnderItsNameAndTheBasicOneSuitsEveryWorld) {
  for (const PredictorTraits& traits : predictors()) {
    const auto found = find_predictor(traits.name);
    ASSERT_TRUE(found) << traits.name;
    EXPECT_EQ(*found, &traits);
    EXPECT_LE(traits.tracker.hit_k, traits.tracker.least_k) << traits.name;
    if (!traits.reads_world) {
      EXPECT_TRUE(make_predictor(traits.name, 1, {}));
    }
  }
  EXPECT_EQ(basic_predictor().most_bodies, UINT32_MAX);
  EXPECT_FALSE(basic_predictor().only_spheres);
  EXPECT_FALSE(basic_predictor().reads_world);
}

TEST(MakePredictor, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(find_predictor("psychic").error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(make_predictor("psychic", 1, {}).error().code, ErrorCode::kUnsupported);
  const std::vector<std::int32_t> constants{1};
  EXPECT_EQ(make_predictor("ballistic", 1, constants).error().code, ErrorCode::kMalformed);
}

struct Shapes {
  std::size_t planes = 0, boxes = 0, balls = 0;
};
std::vector<std::int32_t> constants_with(std::string_view predictor, const Shapes& shapes,
                                         std::int32_t substeps) {
  ContactConstants constants;
  constants.substeps = substeps;
  constants.types = {{1, 65536}};
  constants.planes.resize(shapes.planes);
  constants.boxes.resize(shapes.boxes);
  constants.balls.resize(shapes.balls);
  if ((*find_predictor(predictor))->reads_shapes)
    return write_rigid_constants({constants, {{Solid::Kind::kRound, {1, 0, 0}}}});
  return write_contact_constants(constants);
}
bool is_lawful(std::string_view predictor, std::uint32_t capacity, const Shapes& shapes,
               std::int32_t substeps = 1) {
  return check_predictor(predictor, capacity, constants_with(predictor, shapes, substeps)).has_value();
}

TEST(StepWork, OfTheLargestWorldsOfOurScenesIsLawful) {
  EXPECT_TRUE(is_lawful("field", 1U << 20U, {.planes = 8}));
  EXPECT_TRUE(is_lawful("field", 1U << 20U, {.planes = 6, .boxes = 4}));  // four_cubes
  EXPECT_TRUE(is_lawful("contact", 1U << 18U, {.planes = 8}, 4));
  EXPECT_TRUE(is_lawful("hard", 1U << 18U, {.planes = 8, .boxes = 8}));
  EXPECT_TRUE(is_lawful("rigid", 1U << 14U, {.planes = 8, .boxes = 8}, 8));
  EXPECT_TRUE(is_lawful("rigid", 1'000, {256, 256, 256}, 8));
  EXPECT_TRUE(check_predictor("ballistic", kMaxCapacity, {}));
}

TEST(StepWork, IsBoundedInEveryFactor) {
  EXPECT_FALSE(is_lawful("rigid", 1U << 14U, {256, 256, 256}, 4));
  EXPECT_FALSE(is_lawful("hard", 1U << 18U, {256, 256, 256}));
  EXPECT_FALSE(is_lawful("field", 1U << 16U, {256, 256, 256}));
  EXPECT_FALSE(is_lawful("field", kMaxCapacity, {}));
  EXPECT_FALSE(is_lawful("field", 1'000'000, {.planes = 8, .balls = 8}));
  EXPECT_FALSE(is_lawful("contact", 1U << 18U, {}, 16));
}

TEST(StepWork, IsRefusedByNameWithWhatHelpsAndBeforeAnythingIsAllocated) {
  const auto made = make_predictor("rigid", 1U << 14U, constants_with("rigid", {256, 256, 256}, 4));
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(
      made.error().message,
      "predictor 'rigid' takes too long to step 16384 slots with 768 shapes: it takes at most 2767 slots "
      "with so many. Have fewer slots or shapes, or predictor 'ballistic'");
  EXPECT_TRUE(make_predictor("rigid", 2767, constants_with("rigid", {256, 256, 256}, 4)));
  EXPECT_EQ(check_predictor("hard", (1U << 18U) + 1, {}).error().message,
            "predictor 'hard' takes 1 to 262144 slots");
  const std::vector<std::int32_t> nonsense(11, -1);
  EXPECT_TRUE(check_predictor("contact", 1U << 20U, nonsense))
      << "the constants are refused when they are read";
}

}  // namespace
}  // namespace tandem
