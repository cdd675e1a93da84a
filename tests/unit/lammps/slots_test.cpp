#include "services/adapters/lammps/slots.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

namespace tandem_lammps {
namespace {

using testing::ElementsAre;
using Ids = std::vector<std::int64_t>;

std::vector<std::uint32_t> assign(Slots& slots, const Ids& ids) {
  const auto given = slots.assign(ids);
  return {given.begin(), given.end()};
}

TEST(LammpsSlots, AtomsKeepTheirSlotsInAnyOrder) {
  Slots slots(4);
  EXPECT_THAT(assign(slots, {3, 1, 2}), ElementsAre(2, 0, 1));
  EXPECT_THAT(assign(slots, {1, 2, 3}), ElementsAre(0, 1, 2));
  EXPECT_THAT(slots.alive(), ElementsAre(1, 1, 1, 0));
}

TEST(LammpsSlots, ALostAtomLeavesItsSlotToTheNextOne) {
  Slots slots(3);
  assign(slots, {1, 2, 3});
  assign(slots, {1, 3});
  EXPECT_EQ(slots.gone(), 1U);
  EXPECT_THAT(slots.alive(), ElementsAre(1, 0, 1));
  EXPECT_THAT(assign(slots, {900, 3, 1}), ElementsAre(1, 2, 0));
  EXPECT_THAT(slots.alive(), ElementsAre(1, 2, 1));  // another atom: another number
}

TEST(LammpsSlots, ADeathAndABirthInOneFrameShow) {
  Slots slots(1);
  assign(slots, {7});
  assign(slots, {8});
  EXPECT_THAT(slots.alive(), ElementsAre(2));
  for (std::int64_t id = 9; id < 400; ++id) {
    const auto before = slots.alive()[0];
    assign(slots, {id});
    EXPECT_NE(slots.alive()[0], before);
    EXPECT_NE(slots.alive()[0], 0);
  }
}

TEST(LammpsSlots, WhatHasNoRoomIsLeftOut) {
  Slots slots(2);
  EXPECT_THAT(assign(slots, {30, 10, 20}), ElementsAre(Slots::kNone, 0, 1));
  EXPECT_EQ(slots.left_out(), 1U);
  EXPECT_THAT(assign(slots, {30, 20, 0, -5}), ElementsAre(0, 1, Slots::kNone, Slots::kNone));
}

TEST(LammpsSlots, AnyHistoryGivesEachAtomOneSlot) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  Slots slots(50);
  std::map<std::int64_t, std::uint32_t> model;
  std::set<std::int64_t> there;
  std::int64_t next = 1;
  for (int frame = 0; frame < 300; ++frame) {
    for (int i = 0; i < 5; ++i) {
      if (random() % 2 == 0 && there.size() < 60)
        there.insert(next += 1 + (random() % 50 == 0 ? 1 << 25 : 0));
      if (random() % 2 == 0 && !there.empty())
        there.erase(std::next(there.begin(), static_cast<long>(random() % there.size())));
    }
    Ids ids(there.begin(), there.end());
    std::ranges::shuffle(ids, random);
    if (frame % 50 == 49) {
      Slots other(50);
      ASSERT_TRUE(other.load(slots.save()));
      slots = other;
    }
    const auto given = assign(slots, ids);
    std::map<std::int64_t, std::uint32_t> now;
    std::set<std::uint32_t> used;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (given[i] == Slots::kNone) continue;
      now[ids[i]] = given[i];
      EXPECT_TRUE(used.insert(given[i]).second);
      EXPECT_NE(slots.alive()[given[i]], 0);
      const auto before = model.find(ids[i]);
      EXPECT_TRUE(before == model.end() || before->second == given[i]);
    }
    EXPECT_EQ(used.size(), std::min<std::size_t>(ids.size(), 50));
    EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(slots.alive(), 0)), 50 - used.size());
    model = now;
  }
}

TEST(LammpsSlots, BytesOfOtherSlotsAreRefused) {
  Slots slots(3);
  assign(slots, {1, 2});
  std::vector<std::uint8_t> bytes = slots.save();
  EXPECT_FALSE(Slots(4).load(bytes));
  bytes[8] = 1;  // slot 1 says id 1, too
  EXPECT_FALSE(slots.load(bytes));
  EXPECT_THAT(assign(slots, {2, 1}), ElementsAre(1, 0));
}

}  // namespace
}  // namespace tandem_lammps
