#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>

#include "sdk/core/lattice/slot_runs.hpp"
#include "sdk/workers/block_threads.hpp"
#include "services/host/streams/mirror.hpp"
#include "services/host/streams/quantise.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host::of_mirror {
namespace {

using engine::Event;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

class MirrorTest : public ::testing::Test {
 protected:
  MirrorTest() { mirror.start(simulation.bodies()); }
  void update(std::vector<Event> events = {}) { mirror.update(simulation.bodies(), events); }
  [[nodiscard]] std::vector<std::pair<LifecycleKind, Slot>> records() const {
    std::vector<std::pair<LifecycleKind, Slot>> all;
    for (const auto& record : mirror.lifecycle()) all.emplace_back(record.kind, record.slot);
    return all;
  }
  using Records = std::vector<std::pair<LifecycleKind, Slot>>;

  Lattice lattice = *choose_lattice(1.0 / 64, 64, 1.0 / 30);
  FakeSimulation simulation{4};
  Mirror mirror{lattice, 4, 3};
};

TEST_F(MirrorTest, RoundsPositionsAndVelocitiesToTheNearestUnit) {
  simulation.position[0][1] = 1.5F;
  simulation.position[1][1] = -0.25F;
  simulation.velocity[2][1] = -3.0F;
  update();
  EXPECT_EQ(mirror.target().p(0)[1], 3 << 17);
  EXPECT_EQ(mirror.target().p(1)[1], -(1 << 16));
  EXPECT_EQ(mirror.target().v(2)[1], -std::lround(0.1 * (1 << 18) * 64));
  EXPECT_TRUE(mirror.lifecycle().empty());
}

TEST_F(MirrorTest, QuantisationErrsByHalfAUnitAtMost) {
  const std::uint32_t seed = 20240711;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> anywhere(-64, 64);
  std::vector<float> in(1003);
  for (float& x : in) x = anywhere(random);
  std::vector<std::int32_t> out(in.size()), off(in.size());
  quantise_column(in, lattice.position_scale(), kPositionLimit, 1e9F, out, off);
  for (std::size_t i = 0; i < in.size(); ++i) {
    EXPECT_LE(std::abs(out[i] - double{in[i]} * lattice.position_scale()), 0.5);
    EXPECT_EQ(off[i], 0);
  }
}

TEST_F(MirrorTest, FastBodiesSaturateAndStay) {
  simulation.velocity[0][0] = 1e30F;
  simulation.velocity[1][0] = -1e30F;
  update();
  EXPECT_EQ(mirror.target().v(0)[0], kVelocityLimit);
  EXPECT_EQ(mirror.target().v(1)[0], -kVelocityLimit);
  EXPECT_TRUE(mirror.lifecycle().empty());
}

TEST_F(MirrorTest, ABodyThatLeavesTheLatticeIsDespawned) {
  simulation.position[2][3] = 5000;  // the lattice reaches 4096 m
  update();
  EXPECT_EQ(records(), (Records{{LifecycleKind::kDespawn, 3}}));
  EXPECT_EQ(mirror.target().alive()[3], 0);
  EXPECT_EQ(mirror.target().p(2)[3], 0);
  EXPECT_EQ(mirror.mishaps().removed, 1U);
}

TEST_F(MirrorTest, ABodyBeyondTheExtentIsDespawnedAlthoughTheLatticeGoesOn) {
  Mirror near{lattice, 4, 3, {}, 5};
  near.start(simulation.bodies());
  simulation.position[2][3] = -5;
  near.update(simulation.bodies(), {});
  EXPECT_TRUE(near.lifecycle().empty());
  simulation.position[2][3] = -5.001F;
  near.update(simulation.bodies(), {});
  EXPECT_EQ(near.target().alive()[3], 0);
  EXPECT_EQ(near.mishaps().removed, 1U);
  EXPECT_EQ(near.last_hidden(), "slot 3 (its z is -5.001, beyond the extent, 5)");
  EXPECT_EQ(near.hidden(), 1U);
}

TEST_F(MirrorTest, NanAndInfinityDespawnTheBodyAndTouchNoOther) {
  simulation.position[0][0] = kNan;
  simulation.velocity[1][1] = kInfinity;
  simulation.velocity[2][2] = kNan;
  simulation.position[0][3] = 2;
  update();
  EXPECT_EQ(
      records(),
      (Records{{LifecycleKind::kDespawn, 0}, {LifecycleKind::kDespawn, 1}, {LifecycleKind::kDespawn, 2}}));
  EXPECT_EQ(mirror.target().p(0)[3], 1 << 19);
  EXPECT_EQ(mirror.target().alive_count(), 1U);
}

TEST_F(MirrorTest, AHiddenBodyIsBackAsAnotherOneOnceItIsWholeAndInside) {
  for (const auto& [p, v] : {std::pair{5000.0F, 0.0F}, {kNan, 0.0F}, {1.0F, kNan}}) {
    const std::uint8_t reuse = mirror.target().reuse()[2];
    simulation.position[0][2] = p;
    simulation.velocity[1][2] = v;
    update();
    EXPECT_EQ(records(), (Records{{LifecycleKind::kDespawn, 2}}));
    update();
    EXPECT_TRUE(mirror.lifecycle().empty());
    EXPECT_EQ(mirror.hidden(), 1U);
    simulation.position[0][2] = 1;
    simulation.velocity[1][2] = 0;
    update();
    ASSERT_EQ(records(), (Records{{LifecycleKind::kSpawn, 2}}));
    EXPECT_EQ(mirror.lifecycle()[0].reuse, reuse + 1);
    EXPECT_EQ(mirror.lifecycle()[0].body.p[0], 1 << 18);
    EXPECT_EQ(mirror.hidden(), 0U);
  }
}

TEST_F(MirrorTest, AllBodiesThatAreNoneForAFrameAreBackInTheNext) {
  for (float& x : simulation.position[0]) x = kNan;
  update();
  EXPECT_EQ(mirror.hidden(), 4U);
  EXPECT_EQ(mirror.target().alive_count(), 0U);
  for (float& x : simulation.position[0]) x = 0;
  update();
  EXPECT_EQ(mirror.target().alive_count(), 4U);
}

TEST_F(MirrorTest, ABodyThatIsHiddenAndDiesIsHiddenNoMore) {
  simulation.position[0][2] = kNan;
  update();
  simulation.alive[2] = 0;
  update();
  EXPECT_EQ(mirror.hidden(), 0U);
  simulation.alive[2] = 1;
  update();
  EXPECT_EQ(mirror.hidden(), 1U);
  EXPECT_EQ(mirror.mishaps().removed, 2U) << "another body that is none";
}

TEST_F(MirrorTest, WhatWasHiddenAtACheckpointIsHiddenAfterItAndThenAnotherBody) {
  simulation.position[0][2] = kNan;
  update();
  std::vector<std::uint8_t> next_reuse, withheld;
  mirror.save(next_reuse, withheld);
  Mirror later{lattice, 4, 3};
  later.start(simulation.bodies());
  later.restore(next_reuse, withheld);
  EXPECT_EQ(later.target(), mirror.target());
  simulation.position[0][2] = 1;
  update();
  later.update(simulation.bodies(), {});
  EXPECT_EQ(later.target(), mirror.target());
  // An engine that is whole where it was not when it was saved.
  Mirror whole{lattice, 4, 3};
  whole.start(simulation.bodies());
  whole.restore(next_reuse, withheld);
  EXPECT_EQ(whole.target(), mirror.target());
}

TEST_F(MirrorTest, DespawnAndSpawnFollowTheBodiesEvenWithoutEvents) {
  simulation.alive[1] = 0;
  update();
  EXPECT_EQ(records(), (Records{{LifecycleKind::kDespawn, 1}}));
  simulation.alive[1] = 1;
  simulation.type[1] = 2;
  simulation.position[0][1] = 3;
  update();
  ASSERT_EQ(records(), (Records{{LifecycleKind::kSpawn, 1}}));
  EXPECT_EQ(mirror.lifecycle()[0].type, 2);
  EXPECT_EQ(mirror.lifecycle()[0].reuse, 1);
  EXPECT_EQ(mirror.lifecycle()[0].body.p[0], 3 << 18);
  EXPECT_EQ(mirror.target().reuse()[1], 1);
}

TEST_F(MirrorTest, ReuseWithinOneStepIsADespawnAndThenASpawn) {
  update({{Event::Kind::kDespawned, 1}, {Event::Kind::kSpawned, 1}});
  EXPECT_EQ(records(), (Records{{LifecycleKind::kDespawn, 1}, {LifecycleKind::kSpawn, 1}}));
  EXPECT_EQ(mirror.target().reuse()[1], 1);
}

TEST_F(MirrorTest, ASpawnAndDespawnWithinOneStepIsNothingForADeadSlot) {
  simulation.alive[1] = 0;
  update();
  update({{Event::Kind::kDespawned, 1}, {Event::Kind::kSpawned, 1}});
  EXPECT_TRUE(mirror.lifecycle().empty());
}

TEST_F(MirrorTest, GenerationsCountReuseAndWrapAfter256) {
  for (int i = 1; i <= 300; ++i) {
    simulation.alive[0] = 0;
    update();
    simulation.alive[0] = 1;
    update();
    ASSERT_EQ(mirror.target().reuse()[0], static_cast<std::uint8_t>(i));
  }
}

TEST_F(MirrorTest, ASlotUsedForTheFirstTimeIsGenerationZero) {
  FakeSimulation later(4);
  later.alive[2] = 0;
  Mirror other(lattice, 4, 3);
  other.start(later.bodies());
  later.alive[2] = 1;
  other.update(later.bodies(), {});
  ASSERT_EQ(other.lifecycle().size(), 1U);
  EXPECT_EQ(other.lifecycle()[0].reuse, 0);
}

TEST_F(MirrorTest, TeleportCarriesTheNewPlace) {
  simulation.position[1][0] = -7;
  update({{Event::Kind::kTeleported, 0}});
  ASSERT_EQ(records(), (Records{{LifecycleKind::kTeleport, 0}}));
  EXPECT_EQ(mirror.lifecycle()[0].body.p[1], -(7 << 18));
}

TEST_F(MirrorTest, TypeChangeIsARecordOfItsOwn) {
  simulation.type[2] = 1;
  update({{Event::Kind::kTypeChanged, 2}});
  ASSERT_EQ(records(), (Records{{LifecycleKind::kTypeChange, 2}}));
  EXPECT_EQ(mirror.lifecycle()[0].type, 1);
  update();
  EXPECT_TRUE(mirror.lifecycle().empty());
}

TEST_F(MirrorTest, TeleportAndTypeChangeInOneStepArriveInTwoFrames) {
  simulation.type[2] = 1;
  update({{Event::Kind::kTeleported, 2}, {Event::Kind::kTypeChanged, 2}});
  EXPECT_EQ(records(), (Records{{LifecycleKind::kTeleport, 2}}));
  update();
  EXPECT_EQ(records(), (Records{{LifecycleKind::kTypeChange, 2}}));
}

TEST_F(MirrorTest, ABodyOfAnUnlistedTypeIsNotShown) {
  simulation.type[3] = 3;
  update();
  EXPECT_EQ(records(), (Records{{LifecycleKind::kDespawn, 3}}));
}

TEST_F(MirrorTest, EventsOutOfRangeAreIgnored) {
  update({{Event::Kind::kTeleported, 4}, {Event::Kind::kSpawned, 0xFFFFFFFF}});
  EXPECT_TRUE(mirror.lifecycle().empty());
}

TEST_F(MirrorTest, DeadSlotsAreZeroWhateverTheEngineLeavesInThem) {
  simulation.alive[0] = 0;
  simulation.position[0][0] = kNan;
  simulation.velocity[0][0] = 12;
  simulation.type[0] = 2;
  update();
  State zero(4);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(mirror.target().p(i)[0], 0);
    EXPECT_EQ(mirror.target().v(i)[0], 0);
  }
  EXPECT_EQ(mirror.target().type()[0], 0);
}

TEST_F(MirrorTest, RecordsAscendBySlotWithDespawnBeforeSpawn) {
  const std::uint32_t seed = 77;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  FakeSimulation crowd(64);
  Mirror follower(lattice, 64, 3);
  follower.start(crowd.bodies());
  State replica = follower.target();
  for (int step = 0; step < 500; ++step) {
    std::vector<Event> events;
    for (Slot s = 0; s < 64; ++s) {
      const auto dice = random() % 16;
      if (dice == 0) crowd.alive[s] ^= 1U;
      if (dice == 1) events.push_back({Event::Kind::kTeleported, s});
      if (dice == 2) events.push_back({Event::Kind::kSpawned, s});
      if (dice == 3) crowd.type[s] = static_cast<std::uint16_t>(random() % 4);
      if (dice == 4) crowd.position[0][s] = random() % 4 == 0 ? kNan : static_cast<float>(random() % 5000);
    }
    follower.update(crowd.bodies(), events);
    const LifecycleRecord* before = nullptr;
    for (const LifecycleRecord& record : follower.lifecycle()) {
      if (before != nullptr && before->slot == record.slot) {
        EXPECT_EQ(before->kind, LifecycleKind::kDespawn);
        EXPECT_EQ(record.kind, LifecycleKind::kSpawn);
      } else if (before != nullptr) {
        EXPECT_LT(before->slot, record.slot);
      }
      before = &record;
      if (record.kind == LifecycleKind::kDespawn) replica.despawn(record.slot);
      if (record.kind == LifecycleKind::kSpawn)
        replica.spawn(record.slot, record.reuse, record.type, record.body);
      if (record.kind == LifecycleKind::kTypeChange) replica.type()[record.slot] = record.type;
    }
    ASSERT_TRUE(std::ranges::equal(replica.alive(), follower.target().alive()));
    ASSERT_TRUE(std::ranges::equal(replica.reuse(), follower.target().reuse()));
    ASSERT_TRUE(std::ranges::equal(replica.type(), follower.target().type()));
  }
}

// A mirror reads blocks side by side, and leaves out those of which the engine says that nothing moved.

constexpr std::uint32_t kManySlots = 3 * kBlockSlots + 777;

class MirrorBlocks : public ::testing::Test {
 protected:
  MirrorBlocks() : moved(block_count(kManySlots)) {
    std::uniform_real_distribution<float> anywhere(-40, 40);
    for (auto& column : simulation.position) {
      for (float& x : column) x = anywhere(random);
    }
    for (Slot slot = 0; slot < kManySlots; slot += 1000) simulation.alive[slot] = 0;
    for (Mirror* mirror : {&plain, &told}) mirror->start(simulation.bodies());
    update();
  }
  void change(Slot slot) { moved[slot / kBlockSlots] = 1; }
  /// Shows both mirrors the same step. The one that is told what moved sees what the other one sees.
  void update(std::vector<Event> events = {}) {
    const State before = told.target();
    const std::vector<std::uint64_t> numbers(told.numbers().begin(), told.numbers().end());
    plain.update(simulation.bodies(), events);
    told.update(simulation.bodies(), events, moved, run);
    std::ranges::fill(moved, std::uint8_t{0});
    ASSERT_EQ(told.target(), plain.target());
    ASSERT_EQ(told.lifecycle().size(), plain.lifecycle().size());
    for (std::size_t i = 0; i < told.lifecycle().size(); ++i) {
      ASSERT_EQ(told.lifecycle()[i].kind, plain.lifecycle()[i].kind);
      ASSERT_EQ(told.lifecycle()[i].slot, plain.lifecycle()[i].slot);
      ASSERT_EQ(told.lifecycle()[i].body, plain.lifecycle()[i].body);
    }
    kept = 0;
    for (std::uint32_t block = 0; block < numbers.size(); ++block) {
      if (told.numbers()[block] != numbers[block]) continue;
      ++kept;
      State same = told.target();
      const Slot first = block * kBlockSlots;
      copy_slots(before, same, first, std::min(kBlockSlots, kManySlots - first));
      ASSERT_EQ(same, told.target()) << "a block with the same number differs";
    }
  }

  std::mt19937 random{7};
  Lattice lattice = *choose_lattice(1.0 / 64, 64, 1.0 / 30);
  FakeSimulation simulation{kManySlots};
  Mirror plain{lattice, kManySlots, 3}, told{lattice, kManySlots, 3};
  RunBlocks run = blocks_on_threads(3, Callers::kOne);
  std::vector<std::uint8_t> moved;
  std::uint32_t kept = 0;  // blocks that kept their number in the last update
};

TEST_F(MirrorBlocks, KeepTheirNumbersWhileNothingChanges) {
  update();
  EXPECT_EQ(kept, 4U);
  std::ranges::fill(moved, std::uint8_t{1});
  update();
  EXPECT_EQ(kept, 4U) << "a block that is read and is as it was";
  simulation.position[1][kBlockSlots + 5] += 1;
  change(kBlockSlots + 5);
  update();
  EXPECT_EQ(kept, 3U);
  simulation.velocity[2][5] = 3;
  change(5);
  update();
  EXPECT_EQ(kept, 3U);
  update();
  EXPECT_EQ(kept, 4U);
}

TEST_F(MirrorBlocks, AreNotReadIfNothingMoved) {
  simulation.position[0][3] += 1;  // which the engine denies
  told.update(simulation.bodies(), {}, moved);
  plain.update(simulation.bodies(), {});
  EXPECT_NE(told.target().p(0)[3], plain.target().p(0)[3]);
  const std::vector<std::uint8_t> of_another_size(2);
  told.update(simulation.bodies(), {}, of_another_size);
  EXPECT_EQ(told.target(), plain.target());
}

TEST_F(MirrorBlocks, TellOfBodiesThatComeAndGoInThem) {
  simulation.alive[20] = 0;
  change(20);
  update();
  EXPECT_EQ(told.lifecycle().size(), 1U);
  update();
  EXPECT_TRUE(told.lifecycle().empty());
  simulation.alive[20] = 1;
  simulation.alive[1000] = 1;
  change(20);
  update({{Event::Kind::kSpawned, 20}});
  EXPECT_EQ(told.lifecycle().size(), 2U);
  update({{Event::Kind::kTeleported, 30'500}});
  EXPECT_EQ(told.lifecycle().size(), 1U);
  // A type that changes with a teleport follows in the next frame, though nothing moves in it.
  simulation.type[30'500] = 2;
  change(30'500);
  update({{Event::Kind::kTeleported, 30'500}});
  update();
  ASSERT_EQ(told.lifecycle().size(), 1U);
  EXPECT_EQ(told.lifecycle()[0].kind, LifecycleKind::kTypeChange);
}

TEST_F(MirrorBlocks, HideBodiesThatLeftAndShowThemAgain) {
  simulation.position[0][100] = 1e6F;
  change(100);
  update();
  EXPECT_EQ(told.lifecycle().size(), 1U);
  EXPECT_EQ(told.target().alive()[100], 0);
  update();
  EXPECT_EQ(kept, 4U) << "a body that is hidden leaves its block silent";
  EXPECT_EQ(told.hidden(), 1U);
  update();
  EXPECT_EQ(told.hidden(), 1U) << "in a block that is not read";
  simulation.position[0][100] = 1;
  change(100);
  update();
  EXPECT_EQ(told.lifecycle().size(), 1U);
  EXPECT_EQ(told.target().alive()[100], 1);
  EXPECT_EQ(told.hidden(), 0U);
}

TEST_F(MirrorBlocks, ShowWhatRandomStepsDo) {
  std::uniform_int_distribution<Slot> any(0, kManySlots - 1);
  for (int step = 0; step < 60 && !HasFatalFailure(); ++step) {
    std::vector<Event> events;
    for (int i = 0; i < 3; ++i) {
      const Slot slot = any(random);
      change(slot);
      switch (random() % 6) {
        case 0:
          simulation.alive[slot] = simulation.alive[slot] == 0 ? 1 : 0;
          break;
        case 1:
          simulation.type[slot] = static_cast<std::uint16_t>(random() % 4);
          break;
        case 2:
          simulation.position[1][slot] = std::numeric_limits<float>::quiet_NaN();
          break;
        case 3:
          simulation.position[1][slot] = 2;
          events.push_back({Event::Kind::kTeleported, slot});
          break;
        default:
          simulation.position[2][slot] += 0.5F;
      }
    }
    std::ranges::sort(events, {}, &Event::slot);
    update(events);
  }
}

}  // namespace
}  // namespace tandem::host::of_mirror
