#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {
namespace {

// Whether the preset compiles assertions in or not.
TEST(Assertion, TheHandlerIsToldBeforeTheProcessEnds) {
  const auto die = [](AssertionHandler handler) {
    assertion_handler = handler;
    assertion_failed("frames ascend", "timeline.cpp", 7);
  };
  EXPECT_DEATH(die(nullptr), "timeline.cpp:7: broken invariant: frames ascend");
  EXPECT_DEATH(die([](const char* condition, const char* file, int line) {
                 std::fprintf(stderr, "seed 5, %s, %s, %d", condition, file, line);
               }),
               "^seed 5, frames ascend, timeline.cpp, 7$");
}

#ifdef TANDEM_ASSERTIONS
TEST(Assertion, WhatHoldsIsPassedAndWhatDoesNotEndsTheProcess) {
  TANDEM_ASSERT(State(2).capacity() == 2);
  EXPECT_DEATH(State(0), "state.cpp:[0-9]+: broken invariant: ");
}
#endif

TEST(State, ADeadSlotIsZeroInEveryColumn) {
  State state(3);
  state.spawn(1, 7, 2, {{10, 20, 30}, {1, 2, 3}});
  state.c(0)[1] = 5;
  state.despawn(1);
  EXPECT_EQ(state, State(3));
}

TEST(State, SettingABodyClampsToTheLattice) {
  State state(1);
  state.spawn(0, 0, 0, {{INT32_MAX, INT32_MIN, 0}, {INT32_MAX, INT32_MIN, 0}});
  EXPECT_EQ(state.body(0),
            (BodyState{{kPositionLimit, -kPositionLimit, 0}, {kVelocityLimit, -kVelocityLimit, 0}}));
}

TEST(State, DistanceIsExactAtTheCornersOfTheLattice) {
  const Vec3i a{kPositionLimit, kPositionLimit, kPositionLimit};
  const Vec3i b{-kPositionLimit, -kPositionLimit, -kPositionLimit};
  EXPECT_EQ(distance_squared(a, b), 3ULL << 62U);
}

TEST(StateHasher, TheHashOfTwoBodiesIsTheOneOfThePublishedFormat) {
  State state(2);
  state.spawn(1, 1, 3, {{-1, 2, 100000}, {64, -64, 0}});
  state.rest()[1] = 1;
  std::vector<std::byte> common, position;
  const auto add = [](std::vector<std::byte>& bytes, std::initializer_list<int> values) {
    for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  };
  add(common, {0, 1});        // alive
  add(common, {0, 1});        // reuse
  add(common, {0, 0, 3, 0});  // type
  add(common, {0, 1});        // rest
  add(common, {0, 7, 0, 9});  // two columns of a codec
  add(common, {0, 5});        // one of a predictor
  add(position, {0, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0xA0, 0x86, 1, 0});  // p
  add(position, {0, 0, 0, 0, 64, 0, 0, 0, 0, 0, 0, 0, 0xC0, 255, 255, 255, 0, 0, 0, 0, 0, 0, 0, 0});      // v
  position.resize(position.size() + 24);                                                                  // c
  const std::array leaves{hash_bytes(common), hash_bytes(position)};
  const std::uint64_t all = hash_bytes(std::as_bytes(std::span(leaves)));
  const std::array codec{std::byte{0}, std::byte{7}, std::byte{0}, std::byte{9}};
  const std::array predictor{std::byte{0}, std::byte{5}};
  EXPECT_EQ(StateHasher().hash(state, {codec, predictor}), hash_bytes(std::as_bytes(std::span(&all, 1))));
}

TEST(StateHasher, EveryColumnCounts) {
  State state(2);
  state.spawn(0, 1, 1, {{1, 1, 1}, {1, 1, 1}});
  StateHasher hasher;
  const auto before = hasher.hash(state);
  state.c(2)[0] = 1;
  EXPECT_NE(hasher.hash(state), before);
  state.c(2)[0] = 0;
  state.reuse()[0] = 2;
  EXPECT_NE(hasher.hash(state), before);
  state.reuse()[0] = 1;
  state.rest()[0] = 1;
  EXPECT_NE(hasher.hash(state), before);
  state.rest()[0] = 0;
  EXPECT_EQ(hasher.hash(state), before);
}

TEST(StateHasher, BlocksHashedInAnyOrderGiveTheSameHash) {
  State state(2 * kBlockSlots + 5);
  for (Slot slot = 0; slot < state.capacity(); slot += 3) {
    const auto x = static_cast<std::int32_t>(slot);
    state.spawn(slot, 0, 0, {{x, -x, 7}, {1, x, 3}});
  }
  const RunBlocks backwards = [](std::uint32_t count, const std::function<void(std::uint32_t)>& job) {
    while (count > 0) job(--count);
  };
  EXPECT_EQ(StateHasher().hash(state, {}, backwards), StateHasher().hash(state));
}

TEST(Hex, PrintsSixteenDigits) { EXPECT_EQ(to_hex(0x0123456789ABCDEFULL), "0123456789abcdef"); }

TEST(Bytes, WhatWasWrittenIsRead) {
  std::vector<std::byte> memory(15);
  ByteWriter out(memory);
  out.put(std::uint8_t{200});
  out.put(std::int16_t{-2});
  out.put(std::int32_t{INT32_MIN});
  out.put(std::uint64_t{1} << 63U);
  EXPECT_FALSE(out.overflow());
  ByteReader in(out.written());
  EXPECT_EQ(in.get<std::uint8_t>(), 200);
  EXPECT_EQ(in.get<std::int16_t>(), -2);
  EXPECT_EQ(in.get<std::int32_t>(), INT32_MIN);
  EXPECT_EQ(in.get<std::uint64_t>(), std::uint64_t{1} << 63U);
  EXPECT_TRUE(in.at_end());
}

TEST(Bytes, ReadingPastTheEndYieldsZeroAndIsRemembered) {
  const std::vector<std::byte> memory(3, std::byte{1});
  ByteReader in(memory);
  EXPECT_EQ(in.get<std::uint32_t>(), 0U);
  EXPECT_EQ(in.get<std::uint8_t>(), 0U);
  EXPECT_FALSE(in.ok());
}

TEST(Bytes, WritingPastTheEndIsRemembered) {
  std::vector<std::byte> memory(3);
  ByteWriter out(memory);
  out.put(std::uint32_t{1});
  EXPECT_TRUE(out.overflow());
  EXPECT_EQ(out.size(), 0U);
}

TEST(QuickRoot, IsTheSquareRoot) {
  for (std::uint64_t x = 1; x < 100000; ++x) ASSERT_EQ(quick_root(x), square_root(x)) << x;
  std::mt19937_64 random(7);
  for (int i = 0; i < 200000; ++i) {
    const std::uint64_t root = random() >> (36 + random() % 20);
    for (const std::uint64_t x :
         {root * root + 1, root * root + root, root * (root + 2), (root + 1) * (root + 1)}) {
      if (x >= std::uint64_t{1} << 56U) continue;
      ASSERT_EQ(quick_root(x), square_root(x)) << x;
    }
  }
}

}  // namespace
}  // namespace tandem
