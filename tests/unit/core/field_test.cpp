#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/unit/core/contact_world.hpp"

namespace tandem {
namespace {

TEST(Field, IsContactWithOtherConstants) {
  constexpr std::uint64_t kSeed = 73;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const std::vector<std::int32_t> constants = write_contact_constants(in_one_step(constants_of(2)));
  EXPECT_NE(constants, write_contact_constants(constants_of(2)));
  EXPECT_EQ(write_contact_constants(in_one_step(constants_of(1))), write_contact_constants(constants_of(1)));
  const auto contact = *make_predictor("contact", 300, constants);
  const auto field = *make_predictor("field", 300, constants);
  State state = bodies_within(random, 300, 5 * kRadius, 100000);
  State other = state;
  for (int frame = 0; frame < 20; ++frame) {
    contact->step(state, state, kFalling);
    field->step(other, other, kFalling);
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
  const auto predictor = predictor_of("field", kBodies, constants);
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

TEST(Field, ABodyOnThePlaneComesToRest) {
  for (const std::int32_t substeps : {1, 2}) {
    const auto predictor = predictor_of("field", 1, constants_of(substeps));
    State state(1);
    state.spawn(0, 0, 0, {{0, 3 * kRadius, 0}, {}});
    for (int frame = 0; frame < 3000; ++frame) predictor->step(state, state, kFalling);
    EXPECT_NEAR(state.p(1)[0], kRadius, kRadius / 20.0);
    EXPECT_LT(std::abs(state.v(1)[0]), 1000);  // 16 lattice units a frame
  }
}

}  // namespace
}  // namespace tandem
