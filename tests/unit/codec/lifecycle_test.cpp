#include "sdk/core/codec/lifecycle.hpp"

#include <gtest/gtest.h>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::Random;
using Bytes = std::vector<std::byte>;
using Records = std::vector<LifecycleRecord>;
using K = LifecycleKind;

constexpr Groups kPositions{}, kBoth{.orientation = true};
constexpr std::int32_t kOne = kQuaternionOne;
const BodyState kBody{{1, -2, 3}, {4, 5, -6}, {0, kOne, 0, 0}, {7, -8, kSpinLimit / 2}};

Bytes written(const Records& records, const Groups& groups) {
  Bytes bytes(records.size() * most_lifecycle_bytes_per_slot(groups));
  ByteWriter out(bytes);
  write_lifecycle(records, groups, out);
  EXPECT_FALSE(out.overflow());
  bytes.resize(out.size());
  return bytes;
}

LifecycleRecord teleport(Slot slot, std::uint8_t groups, const BodyState& body = kBody) {
  return {.kind = K::kTeleport, .slot = slot, .body = body, .groups = groups};
}

// The state after bytes that have to be accepted.
State after(const State& before, const Bytes& bytes) {
  Records records;
  const auto read = read_lifecycle(bytes, before.groups(), records);
  EXPECT_TRUE(read) << read.error().message;
  State state = before;
  std::vector<std::uint8_t> alive(state.alive().begin(), state.alive().end());
  EXPECT_EQ(check_lifecycle(records, alive, synthetic::kTypes), nullptr);
  apply_lifecycle(records, state);
  return state;
}

State one_at_rest() {
  State state(2, kBoth);
  state.spawn(0, 3, 1, {{9, 9, 9}, {8, 8, 8}, {kOne, 0, 0, 0}, {6, 6, 6}});
  state.rest()[0] = 1;
  for (std::size_t i = 0; i < 3; ++i) state.c(i)[0] = 50;
  return state;
}

TEST(Lifecycle, ASpawnCarriesTheContentOfEveryGroupOfTheStream) {
  const Records spawn{{.kind = K::kSpawn, .slot = 1, .reuse = 200, .type = 2, .body = kBody}};
  EXPECT_EQ(written(spawn, kPositions).size(), 3U + 24U);
  const Bytes bytes = written(spawn, kBoth);
  EXPECT_EQ(bytes.size(), 3U + 24U + 28U);
  const State state = after(State(2, kBoth), bytes);
  EXPECT_EQ(state.body(1), kBody);
  EXPECT_EQ(state.reuse()[1], 200);
  EXPECT_EQ(state.type()[1], 2);
}

TEST(Lifecycle, ATeleportMovesTheGroupsThatItNamesAndWakes) {
  const BodyState before = one_at_rest().body(0);
  const auto moved = [&](std::uint8_t groups, std::size_t content_bytes) {
    const Bytes bytes = written({teleport(0, groups)}, kBoth);
    EXPECT_EQ(bytes.size(), 2 + content_bytes);
    const State state = after(one_at_rest(), bytes);
    EXPECT_EQ(state.rest()[0], 0);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(state.c(i)[0], 0);
    EXPECT_EQ(state.reuse()[0], 3);
    return state.body(0);
  };
  EXPECT_EQ(moved(kMovesPosition, 24), (BodyState{kBody.p, kBody.v, before.q, before.w}));
  EXPECT_EQ(moved(kMovesOrientation, 28), (BodyState{before.p, before.v, kBody.q, kBody.w}));
  EXPECT_EQ(moved(kMovesPosition | kMovesOrientation, 52), kBody);
}

TEST(Lifecycle, ADespawnZeroesTheOrientationToo) {
  EXPECT_EQ(after(one_at_rest(), written({{.kind = K::kDespawn, .slot = 0, .body = {}}}, kBoth)),
            State(2, kBoth));
}

TEST(Lifecycle, ATypeChangeTouchesNoGroup) {
  State expected = one_at_rest();
  expected.type()[0] = 2;
  EXPECT_EQ(
      after(one_at_rest(), written({{.kind = K::kTypeChange, .slot = 0, .type = 2, .body = {}}}, kBoth)),
      expected);
}

TEST(Lifecycle, ATeleportOfGroupsThatTheStreamDoesNotListIsRefused) {
  Records records;
  for (const Groups& groups : {kPositions, kBoth}) {
    for (unsigned mask = 0; mask < 256; ++mask) {
      Bytes bytes = written({teleport(0, bits_of(groups))}, groups);
      bytes[1] = static_cast<std::byte>(mask);
      if (mask == 1) bytes.resize(2 + 24);
      if (mask == 2) bytes.resize(2 + 28);
      const bool listed = mask != 0 && mask <= bits_of(groups);
      EXPECT_EQ(read_lifecycle(bytes, groups, records).has_value(), listed) << "groups " << mask;
    }
  }
}

TEST(Lifecycle, ContentThatEndsTooSoonOrTooLateIsRefused) {
  Records records;
  const Records both{{.kind = K::kSpawn, .slot = 1, .body = kBody}};
  const Bytes whole = written(both, kBoth);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(read_lifecycle(std::span(whole).first(size), kBoth, records)) << size << " bytes";
  EXPECT_FALSE(read_lifecycle(written(both, kPositions), kBoth, records));
  EXPECT_FALSE(read_lifecycle(written({teleport(1, kMovesPosition)}, kBoth), kPositions, records) &&
               read_lifecycle(written({teleport(1, kMovesOrientation)}, kBoth), kPositions, records));
}

TEST(Lifecycle, OrientationsThatNoStateMayHoldAreRefused) {
  const auto refused = [](const Quaternion& q, const Spin& w) {
    for (const K kind : {K::kSpawn, K::kTeleport}) {
      LifecycleRecord record = teleport(0, kMovesPosition | kMovesOrientation, {{}, {}, q, w});
      record.kind = kind;
      std::vector<std::uint8_t> alive{static_cast<std::uint8_t>(kind == K::kTeleport)};
      Records records;
      if (!read_lifecycle(written({record}, kBoth), kBoth, records)) return false;
      if (check_lifecycle(records, alive, synthetic::kTypes) == nullptr) return false;
    }
    return true;
  };
  EXPECT_FALSE(refused(kNoTurn, {}));
  EXPECT_FALSE(refused({0, 0, -kOne, 0}, {0, 0, -kSpinLimit}));
  EXPECT_TRUE(refused({}, {})) << "zeros";
  EXPECT_TRUE(refused({0, 0, 0, kOne + 1}, {})) << "a component";
  EXPECT_TRUE(refused({0, 0, 0, kOne / 2}, {})) << "the norm";
  EXPECT_TRUE(refused({INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN}, {}));
  EXPECT_TRUE(refused(kNoTurn, {kSpinLimit + 1, 0, 0})) << "an axis";
  EXPECT_TRUE(refused(kNoTurn, {0, kSpinLimit, 1})) << "the length";
  EXPECT_TRUE(refused(kNoTurn, {INT32_MIN, INT32_MAX, INT32_MIN}));
}

TEST(Lifecycle, WhatASlotMayCostIsBounded) {
  for (const Groups& groups : {kPositions, kBoth}) {
    constexpr Slot kLast = kMaxCapacity - 1;
    const Records reuse{{.kind = K::kDespawn, .slot = kLast, .body = {}},
                        {.kind = K::kSpawn, .slot = kLast, .reuse = 255, .type = UINT16_MAX, .body = kBody}};
    EXPECT_LE(written(reuse, groups).size(), most_lifecycle_bytes_per_slot(groups));
  }
}

TEST(Lifecycle, WhatWasWrittenIsRead) {
  constexpr std::uint64_t kSeed = 20261122;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  for (int round = 0; round < 300; ++round) {
    const Groups groups{.orientation = random.one_in(2)};
    const std::uint32_t capacity = 1 + static_cast<std::uint32_t>(random.below(300));
    State state(capacity, groups);
    for (const bool first : {true, false}) {
      State target = state;
      Records records = synthetic::random_lifecycle(random, state, target, first ? 1 : 3);
      if (records.empty()) continue;
      for (LifecycleRecord& record : records) {
        if (!groups.orientation) continue;
        record.body.q = synthetic::any_quaternion(random);
        record.body.w = synthetic::any_spin(random);
        record.groups = static_cast<std::uint8_t>(1 + random.below(3));
      }
      State expected = state;
      apply_lifecycle(records, expected);
      state = after(state, written(records, groups));
      ASSERT_EQ(state, expected) << "round " << round;
    }
  }
}

}  // namespace
}  // namespace tandem
