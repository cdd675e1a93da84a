// The mirror of bodies that turn.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "services/host/streams/mirror.hpp"
#include "tests/property/random.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using engine::Event;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr Groups kTurns{.orientation = true};

class MirrorTurnTest : public ::testing::Test {
 protected:
  MirrorTurnTest() {
    simulation.turn();
    mirror.start(simulation.bodies());
  }
  void update(std::vector<Event> events = {}) { mirror.update(simulation.bodies(), events); }
  void orient(Slot slot, std::array<float, 4> q) {
    for (std::size_t i = 0; i < q.size(); ++i) simulation.orientation[i][slot] = q[i];
  }
  void spin(Slot slot, std::array<float, 3> w) {
    for (std::size_t i = 0; i < w.size(); ++i) simulation.angular_velocity[i][slot] = w[i];
  }
  [[nodiscard]] bool shown(Slot slot) const { return mirror.target().alive()[slot] != 0; }

  Lattice lattice = *choose_lattice(1.0 / 64, 64, 1.0 / 64);
  FakeSimulation simulation{4};
  Mirror mirror{lattice, 4, 3, kTurns};
};

TEST_F(MirrorTurnTest, RoundsOrientationsAndTurnsSecondsIntoFrames) {
  orient(1, {0.6F, 0, -0.8F, 0});
  spin(1, {1, -2, 0.5F});
  update();
  const BodyState body = mirror.target().body(1);
  EXPECT_NEAR(body.q[0], 0.6 * kQuaternionOne, 64);  // single precision
  EXPECT_NEAR(body.q[2], -0.8 * kQuaternionOne, 64);
  EXPECT_TRUE(valid_quaternion(body.q));
  EXPECT_EQ(body.w, (Spin{1 << 22, -(2 << 22), 1 << 21}));
  EXPECT_EQ(mirror.target().quaternion(0), kNoTurn);
  EXPECT_TRUE(mirror.lifecycle().empty());
}

TEST_F(MirrorTurnTest, AnInexactNormIsMended) {
  for (const float scale : {0.9952F, 1.0048F}) {
    orient(2, {0, scale * 0.6F, 0, scale * 0.8F});
    update();
    ASSERT_TRUE(shown(2));
    EXPECT_NEAR(mirror.target().q(1)[2], 0.6 * kQuaternionOne, 128);
    EXPECT_NEAR(mirror.target().q(3)[2], 0.8 * kQuaternionOne, 128);
  }
}

TEST_F(MirrorTurnTest, WhatIsNoTurnTakesTheBodyOffAndTouchesNoOther) {
  const std::vector<std::array<float, 4>> bad{
      {0, 0, 0, 0},         {0, 0, 0, 0.99F}, {0, 0, 0, 1.01F}, {kNan, 0, 0, 1},
      {0, kInfinity, 0, 1}, {1e30F, 0, 0, 0}, {1, 1, 1, 1},
  };
  for (const auto& q : bad) {
    orient(0, {0, 0, 0, 1});
    update({{Event::Kind::kSpawned, 0}});
    ASSERT_TRUE(shown(0));
    orient(0, q);
    const std::uint64_t before = mirror.mishaps().removed;
    update();
    EXPECT_FALSE(shown(0)) << q[0] << ' ' << q[1] << ' ' << q[2] << ' ' << q[3];
    EXPECT_EQ(mirror.mishaps().removed, before + 1);
    EXPECT_EQ(mirror.target().quaternion(0), Quaternion{});
    EXPECT_TRUE(shown(1) && shown(2) && shown(3));
  }
}

TEST_F(MirrorTurnTest, ABodyThatIsNotTurnedAtTheStartIsNotShownUntilItIs) {
  orient(0, {0, 0, 0, 0});
  Mirror late(lattice, 4, 3, kTurns);
  late.start(simulation.bodies());
  EXPECT_EQ(late.target().alive_count(), 3U);
  EXPECT_EQ(late.mishaps().removed, 1U);
  orient(0, {0, 0, 0, 1});
  late.update(simulation.bodies(), {});
  EXPECT_EQ(late.target().alive_count(), 4U);
}

TEST_F(MirrorTurnTest, AnAngularVelocityThatIsNotFiniteTakesTheBodyOff) {
  spin(1, {0, kNan, 0});
  spin(2, {-kInfinity, 0, 0});
  update();
  EXPECT_TRUE(shown(0) && !shown(1) && !shown(2) && shown(3));
  EXPECT_EQ(mirror.target().body(2).w, Spin{});
}

TEST_F(MirrorTurnTest, TooFastATurnIsSlowedAboutItsAxis) {
  spin(0, {3e38F, 0, -3e38F});
  spin(1, {0, -1000, 0});
  spin(2, {300, 400, 0});
  update();
  for (Slot slot = 0; slot < 3; ++slot) EXPECT_TRUE(shown(slot) && valid_spin(mirror.target().body(slot).w));
  EXPECT_NEAR(mirror.target().w(0)[0], kSpinLimit * std::sqrt(0.5), 2);
  EXPECT_EQ(mirror.target().w(0)[0], -mirror.target().w(2)[0]);
  EXPECT_NEAR(mirror.target().w(1)[1], -kSpinLimit, 2);
  EXPECT_NEAR(mirror.target().w(0)[2], 0.6 * kSpinLimit, 2);
  EXPECT_NEAR(mirror.target().w(1)[2], 0.8 * kSpinLimit, 2);
  EXPECT_TRUE(mirror.lifecycle().empty());
  EXPECT_EQ(mirror.mishaps(), (engine::Mishaps{.removed = 0, .clamped = 3}));
  EXPECT_EQ(mirror.last_slowed(), 2U);
}

TEST_F(MirrorTurnTest, ATurnThatIsTooFastByARoundingIsSlowedToo) {
  spin(0, {128, std::ldexp(1.0F, -22), 0});  // 2^29 and 1: a squared length of 2^58 + 1
  update();
  EXPECT_TRUE(valid_spin(mirror.target().body(0).w));
}

TEST_F(MirrorTurnTest, WhateverTheEngineSaysIsATurnThatAStateMayHold) {
  constexpr std::uint64_t kSeed = 20261122;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  synthetic::Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Quaternion q = synthetic::any_quaternion(random);
    const double scale = 1 + random.even(1000) * 4.9e-6;
    for (std::size_t k = 0; k < q.size(); ++k)
      simulation.orientation[k][0] = static_cast<float>(scale * std::ldexp(q[k], -30));
    for (auto& column : simulation.angular_velocity)
      column[0] =
          static_cast<float>(std::ldexp(random.even(1 << 24), static_cast<int>(random.below(12)) - 24) * 200);
    update();
    ASSERT_TRUE(shown(0)) << "round " << i;
    const BodyState body = mirror.target().body(0);
    ASSERT_TRUE(valid_quaternion(body.q) && valid_spin(body.w)) << "round " << i;
  }
}

TEST_F(MirrorTurnTest, SpawnsAndTeleportsCarryTheOrientation) {
  simulation.alive[1] = 0;
  update();
  simulation.alive[1] = 1;
  for (const Slot slot : {1U, 2U}) {
    orient(slot, {0, 1, 0, 0});
    spin(slot, {0, 0, 1});
  }
  update({{Event::Kind::kTeleported, 2}});
  ASSERT_EQ(mirror.lifecycle().size(), 2U);
  EXPECT_EQ(mirror.lifecycle()[0].kind, LifecycleKind::kSpawn);
  EXPECT_EQ(mirror.lifecycle()[1].kind, LifecycleKind::kTeleport);
  EXPECT_EQ(mirror.lifecycle()[1].groups, kMovesPosition | kMovesOrientation);
  for (const LifecycleRecord& record : mirror.lifecycle()) {
    EXPECT_EQ(record.body.q, (Quaternion{0, kQuaternionOne, 0, 0}));
    EXPECT_EQ(record.body.w, (Spin{0, 0, 1 << 22}));
  }
}

TEST_F(MirrorTurnTest, DeadSlotsAreZeroWhateverTheEngineLeavesInThem) {
  simulation.alive[3] = 0;
  orient(3, {kNan, 0, 0, 0});
  spin(3, {kInfinity, 0, 0});
  update();
  EXPECT_EQ(mirror.target().quaternion(3), Quaternion{});
  EXPECT_EQ(mirror.target().body(3).w, Spin{});
  EXPECT_EQ(mirror.mishaps().removed, 0U);
}

TEST_F(MirrorTurnTest, AStreamWithoutOrientationsIsNotConcernedByThem) {
  Mirror positions(lattice, 4, 3);
  orient(0, {0, 0, 0, 0});
  spin(1, {kNan, 0, 0});
  positions.start(simulation.bodies());
  positions.update(simulation.bodies(), std::vector<Event>{{Event::Kind::kTeleported, 2}});
  EXPECT_EQ(positions.target().alive_count(), 4U);
  EXPECT_FALSE(positions.target().groups().orientation);
  ASSERT_EQ(positions.lifecycle().size(), 1U);
  EXPECT_EQ(positions.lifecycle()[0].groups, kMovesPosition);
}

}  // namespace
}  // namespace tandem::host
