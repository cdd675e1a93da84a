#include "sdk/core/codec/rounding.hpp"

#include <gtest/gtest.h>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

TEST(Rounding, GoesToTheNearestMultipleHalvesUp) {
  State state(6);
  const std::array<std::int32_t, 6> from{7, 8, -8, -9, kPositionLimit, -kPositionLimit};
  const std::array<std::int32_t, 6> to{0, 16, 0, -16, kPositionLimit, -kPositionLimit};
  for (Slot slot = 0; slot < 6; ++slot) {
    const std::int32_t v = std::clamp(from[slot], -kVelocityLimit, kVelocityLimit);
    state.spawn(slot, 0, 0, {{from[slot], 0, 1}, {v, 0, 1}});
    state.c(2)[slot] = v;
  }
  round_before_corrections({4, 4, 4}, state);
  EXPECT_EQ(state.body(0), (BodyState{{0, 0, 0}, {7, 0, 1}})) << "p alone";
  round_after_corrections({4, 4, 4}, state);
  for (Slot slot = 0; slot < 6; ++slot) {
    const std::int32_t v = std::clamp(to[slot], -kVelocityLimit, kVelocityLimit);
    EXPECT_EQ(state.body(slot), (BodyState{{to[slot], 0, 0}, {v, 0, 0}}));
    EXPECT_EQ(state.c(2)[slot], v);
  }
}

TEST(Rounding, ByNoBitsChangesNothing) {
  synthetic::Random random(1);
  const State before = synthetic::random_state(random, 100);
  State state = before;
  round_before_corrections({}, state);
  round_after_corrections({}, state);
  EXPECT_EQ(state, before);
}

TEST(Rounding, LeavesVelocityAndAccelerationOfABodyAtRest) {
  State state(2);
  for (Slot slot = 0; slot < 2; ++slot) {
    state.spawn(slot, 0, 0, {{5, 5, 5}, {}});
    state.c(1)[slot] = 3001;
  }
  state.rest()[0] = 1;
  round_before_corrections({3, 3, 3}, state);
  round_after_corrections({3, 3, 3}, state);
  EXPECT_EQ(state.body(0).p, (Vec3i{8, 8, 8}));
  EXPECT_EQ(state.c(1)[0], 3001) << "it stays the opposite of gravity";
  EXPECT_EQ(state.c(1)[1], 3000);
}

TEST(Rounding, FollowsTheThreshold) {
  EXPECT_EQ(rounding_for(1), (Rounding{0, 1, 0}));
  EXPECT_EQ(rounding_for(100), (Rounding{3, 7, 4}));
  EXPECT_EQ(rounding_for(4096), (Rounding{9, 13, 10}));
  EXPECT_EQ(rounding_for(kPositionLimit), (Rounding{24, 24, 24}));
}

TEST(Rounding, OfAnotherLengthOrByMoreThan24BitsIsRefused) {
  const auto reads = [](std::initializer_list<int> body, const Groups& groups) {
    std::vector<std::byte> bytes;
    for (const int byte : body) bytes.push_back(static_cast<std::byte>(byte));
    return read_rounding(bytes, groups).has_value();
  };
  const auto read = [&](std::initializer_list<int> body) { return reads(body, {}); };
  EXPECT_TRUE(read({24, 24, 24}));
  EXPECT_TRUE(read({0, 0, 0}));
  EXPECT_FALSE(read({25, 0, 0}));
  EXPECT_FALSE(read({0, 255, 0}));
  EXPECT_FALSE(read({0, 0, 25}));
  EXPECT_FALSE(read({0, 0}));
  EXPECT_FALSE(read({0, 0, 0, 0}));
  EXPECT_FALSE(read({}));
  const auto read_turns = [&](std::initializer_list<int> body) { return reads(body, {.orientation = true}); };
  EXPECT_TRUE(read_turns({24, 24, 24, 18, 24}));
  EXPECT_FALSE(read_turns({24, 24, 24, 19, 0}));
  EXPECT_FALSE(read_turns({24, 24, 24, 0, 25}));
  EXPECT_FALSE(read_turns({24, 24, 24}));
  EXPECT_FALSE(read_turns({24, 24, 24, 0}));
  EXPECT_FALSE(read_turns({24, 24, 24, 0, 0, 0}));
}

TEST(Rounding, OfOrientationsKeepsThemInRangeAndNearTheThreshold) {
  synthetic::Random random(2);
  for (const std::int32_t radius : {1, 100, 4096, 1 << 20}) {
    for (const std::int32_t threshold : {1, 41, 4096}) {
      const Rounding rounding = rounding_for(threshold, radius);
      State state(2, {.orientation = true});
      for (int i = 0; i < 200; ++i) {
        BodyState body;
        body.q = synthetic::any_quaternion(random);
        body.w = {kSpinLimit - 1, 0, -1};
        for (Slot slot = 0; slot < 2; ++slot) state.spawn(slot, 0, 0, body);
        state.rest()[1] = 1;
        round_before_corrections(rounding, state);
        EXPECT_EQ(state.spin(0), body.w) << "w comes after the corrections";
        round_after_corrections(rounding, state);
        for (const std::int32_t q : state.quaternion(0)) EXPECT_EQ(q & ((1 << rounding.q) - 1), 0);
        EXPECT_EQ(state.quaternion(0), state.quaternion(1)) << "those at rest too";
        EXPECT_EQ(state.spin(1), body.w);
        EXPECT_TRUE(valid_body(state.body(0)));
        EXPECT_LE(surface_error(state.body(0), body, radius), static_cast<std::uint64_t>(threshold) / 8 + 2);
      }
    }
  }
}

}  // namespace
}  // namespace tandem
