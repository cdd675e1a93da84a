// Bodies that turn: no point of their surface is further off than the threshold, with all that happens to
// slots.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "sdk/core/codec/errors.hpp"
#include "sdk/core/codec/tracker/steps.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tests/unit/timeline/session.hpp"

namespace tandem::of_turn {
namespace {

using namespace synthetic;

constexpr std::int32_t kThreshold = 2048;
constexpr Groups kTurning{.orientation = true};
constexpr std::array<std::int32_t, kTypes> kRadii{1, 40'000, 3'000'000};

Layout turning_layout(std::uint32_t capacity) {
  Layout layout = layout_for("tracker", capacity);
  layout.groups = {kPositionGroup, kOrientationGroup};
  layout.radii = {kRadii.begin(), kRadii.end()};
  layout.parameters.codec.threshold = kThreshold;
  return layout;
}

BodyState tumbling_body(Random& random) {
  const auto vector = [&random](std::int32_t most) {
    return Vec3i{random.value(most), random.value(most), random.value(most)};
  };
  return {vector(50'000'000), vector(90'000), any_quaternion(random), vector(20'000'000)};
}

// A world of its own: bodies fly, turn, bounce, stop; slots live and die.
class World {
 public:
  World(Random& random, std::uint32_t capacity) : random_(random), state_(capacity, kTurning) {
    for (Slot slot = 0; slot < capacity; slot += 1 + static_cast<Slot>(random.below(2))) {
      state_.spawn(slot, 0, type(), tumbling_body(random));
    }
  }
  [[nodiscard]] const State& state() const { return state_; }

  std::vector<LifecycleRecord> step() {
    std::vector<LifecycleRecord> records;
    for (Slot slot = 0; slot < state_.capacity(); ++slot) {
      const bool lives = state_.alive()[slot] != 0;
      if (random_.one_in(150)) {
        if (lives && random_.one_in(2)) {
          records.push_back({LifecycleKind::kDespawn, slot, 0, 0, {}});
          state_.despawn(slot);
        } else if (lives) {
          records.push_back({LifecycleKind::kTeleport, slot, 0, 0, tumbling_body(random_), teleported()});
          move(records.back());
        } else {
          records.push_back({LifecycleKind::kSpawn, slot, 3, type(), tumbling_body(random_)});
          state_.spawn(slot, 3, records.back().type, records.back().body);
        }
      } else if (lives && random_.one_in(300)) {
        records.push_back({LifecycleKind::kTypeChange, slot, 0, type(), {}});
        state_.type()[slot] = records.back().type;
      } else if (lives) {
        go_on(slot);
      }
    }
    return records;
  }

 private:
  TypeId type() { return static_cast<TypeId>(random_.below(kTypes)); }
  std::uint8_t teleported() { return static_cast<std::uint8_t>(1 + random_.below(3)); }
  void move(const LifecycleRecord& record) {
    BodyState body = state_.body(record.slot);
    if ((record.groups & kMovesPosition) != 0) {
      body.p = record.body.p;
      body.v = record.body.v;
    }
    if ((record.groups & kMovesOrientation) != 0) {
      body.q = record.body.q;
      body.w = record.body.w;
    }
    state_.set_body(record.slot, body);
  }
  void go_on(Slot slot) {
    BodyState body = state_.body(slot);
    if (slot % 5 == 0) body.v = body.w = {};  // these rest
    if (slot % 5 != 0 && random_.one_in(20)) {
      body.w = tumbling_body(random_).w;
      body.v = tumbling_body(random_).v;
    }
    for (std::size_t i = 0; i < 3; ++i) body.p[i] += body.v[i] / 64;
    body.q =
        random_.one_in(50) ? any_quaternion(random_) : turned(body.q, body.w);  // some turn about at once
    state_.set_body(slot, body);
  }

  Random& random_;
  State state_;
};

std::uint64_t worst_error(const State& agreed, const State& target) {
  std::uint64_t worst = 0;
  for (Slot slot = 0; slot < agreed.capacity(); ++slot) {
    if (agreed.alive()[slot] == 0) continue;
    worst = std::max(worst, surface_error(agreed.body(slot), target.body(slot), kRadii[target.type()[slot]]));
  }
  return worst;
}

class TurningSession : public testing::TestWithParam<std::uint64_t> {};

TEST_P(TurningSession, HoldsTheSurfaceAndWhoJoinsInMidTurnContinuesToTheBit) {
  SCOPED_TRACE(testing::Message() << "seed " << GetParam());
  Random random(GetParam());
  constexpr std::uint32_t kCapacity = 400;
  const Layout layout = turning_layout(kCapacity);
  auto server = server_of(layout);
  World world(random, kCapacity);
  const Drive drive{{0, -300, 0}, 20};
  server.start(0, world.state(), drive);
  std::vector<ClientTimeline> clients;
  std::uint32_t beyond = 0;
  for (int frame = 0; frame < 200; ++frame) {
    if (frame % 40 == 0) {
      clients.push_back(client_of(layout));
      const auto loaded = clients.back().load(snapshot_of(server), kEpoch);
      ASSERT_TRUE(loaded) << loaded.error().message;
    }
    const auto lifecycle = world.step();
    if (frame % 50 == 49) server.round_next();
    const auto delta = server.advance(world.state(), lifecycle);
    for (ClientTimeline& client : clients) {
      client.step(1);
      const auto applied = apply(client, delta);
      ASSERT_TRUE(applied) << applied.error().message;
    }
    beyond += worst_error(server.state(), world.state()) > kThreshold + 2 ? 1U : 0U;
  }
  EXPECT_EQ(beyond, 0U);
  EXPECT_GT(server.state().rest_count(), 10U);
}
INSTANTIATE_TEST_SUITE_P(Seeds, TurningSession, testing::Range<std::uint64_t>(41, 61));

TEST(TrackerTurns, ABodyThatStopsCostsThreeCorrectionsAtMost) {
  const Layout layout = turning_layout(64);
  auto server = server_of(layout);
  Random random(8);
  State target(64, kTurning);
  for (Slot slot = 0; slot < 64; ++slot) {
    BodyState body = tumbling_body(random);
    target.spawn(slot, 0, 1, body);
  }
  server.start(0, target, {{0, -64 * kThreshold, 0}, 0});
  std::uint32_t corrected = 0;
  for (Slot slot = 0; slot < 64; ++slot) {
    BodyState body = target.body(slot);
    body.v = body.w = {};
    target.set_body(slot, body);
  }
  for (int frame = 0; frame < 30; ++frame) corrected += server.advance(target, {}).corrected;
  EXPECT_LE(corrected, 3 * 64U);
  EXPECT_EQ(server.state().rest_count(), 64U);
  for (int frame = 0; frame < 600; ++frame) ASSERT_TRUE(server.advance(target, {}).payload.empty());
}

TEST(TrackerTurns, ABudgetBindsAndNobodyWaitsForEver) {
  constexpr std::uint64_t kSeed = 43;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  const Layout layout = turning_layout(300);
  auto server = server_of(layout);
  auto client = client_of(layout);
  World world(random, 300);
  server.start(0, world.state(), {});
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  for (int frame = 0; frame < 60; ++frame) {
    const auto lifecycle = world.step();
    const auto delta = server.advance(world.state(), lifecycle, 120);
    if (lifecycle.empty()) {
      EXPECT_LE(delta.payload.size(), 120U);
    }
    ASSERT_TRUE(apply(client, delta));
  }
  // It stands still from now on, so all are served at last.
  for (int frame = 0; frame < 200; ++frame)
    ASSERT_TRUE(apply(client, server.advance(world.state(), {}, 120)));
  EXPECT_LE(worst_error(server.state(), world.state()), kThreshold + 2);
}

TEST(TrackerTurns, SomePointFitsForEveryErrorRadiusAndThreshold) {
  Random random(3);
  TrackerCosts costs;
  costs.learn(TrackerModels());
  std::uint32_t misses = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::int32_t threshold = 64 << random.below(12);
    const std::int32_t radius = threshold * static_cast<std::int32_t>(1 + random.below(50));
    const ErrorWorth worth(threshold, 14);
    const BodyState target = tumbling_body(random);
    BodyState body = target;
    const auto off = [&] { return random.value(2 * threshold); };
    for (std::int32_t& p : body.p) p += off();
    const auto angle = [&] { return (std::int64_t{off()} << 28) / radius; };
    body.q = turned(body.q, limited_spin({angle(), angle(), angle()}));
    TrackerTurningCorrection correction;
    const Rounding rounding = random.one_in(3) ? rounding_for(threshold, radius) : Rounding{};
    if (random.one_in(3)) body.q = any_quaternion(random);
    const bool found = choose_joint_steps({body, target, radius, threshold, rounding}, worth, costs, {},
                                          turn_context({}, {}, {}), correction);
    misses += found ? 0 : 1;
  }
  EXPECT_EQ(misses, 0U);
}

TEST(TrackerTurns, TheErrorOfASurfaceIsThatOfItsWorstPoint) {
  Random random(6);
  for (int i = 0; i < 1000; ++i) {
    const BodyState a = tumbling_body(random);
    BodyState b = a;
    Spin by{};
    for (std::int32_t& x : by) x = random.value(1 << (10 + random.below(17)));
    b.q = turned(a.q, by);
    for (std::size_t axis = 0; axis < 3; ++axis) b.p[axis] += random.value(5000);
    constexpr std::int32_t kRadius = 100'000;
    double angle = 0, apart = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      angle += std::pow(std::ldexp(by[axis], -28), 2);
      apart += std::pow(static_cast<double>(b.p[axis] - a.p[axis]), 2);
    }
    const double expected = std::sqrt(apart) + 2 * kRadius * std::sin(std::sqrt(angle) / 2);
    const auto error = static_cast<double>(surface_error(a, b, kRadius));
    EXPECT_GE(error, expected - 0.01);
    EXPECT_LE(error, expected + 2.5);
    const Spin back = turn_between(a.q, b.q);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(back[axis], by[axis], 8 + std::abs(by[axis]) * 0.0001) << "axis " << axis;
  }
}

TEST(TrackerTurns, ATurnByAnyAngleIsFoundAndMadeAtOnce) {
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const Quaternion from = any_quaternion(random), to = any_quaternion(random);
    const Spin turn = turn_between(from, to);
    const double length = std::ldexp(std::hypot(1.0 * turn[0], 1.0 * turn[1], 1.0 * turn[2]), -28);
    EXPECT_LE(length, 3.1416);
    const Turned there = turned_by(from, {turn[0], turn[1], turn[2]});
    EXPECT_EQ(there.is_far, !valid_spin(turn));
    EXPECT_LE(std::ldexp(static_cast<double>(half_sine(there.q, to)), -30), 1e-4);
  }
}

TEST(TrackerTurns, ATurnTooFarForAnAngularVelocityLeavesItAsItIs) {
  Layout layout = turning_layout(2);
  auto server = server_of(layout);
  State target(2, kTurning);
  for (Slot slot = 0; slot < 2; ++slot) target.spawn(slot, 0, 1, {});
  server.start(0, target, {});
  target.set_quaternion(0, {0, 1 << 30, 0, 0});            // by pi
  target.set_quaternion(1, {0, 514501461, 0, 942438186});  // by 1 rad
  server.advance(target, {});
  EXPECT_EQ(server.state().spin(0), Spin{});
  EXPECT_NE(server.state().spin(1), Spin{});
  EXPECT_LE(worst_error(server.state(), target), kThreshold + 2);
}

}  // namespace
}  // namespace tandem::of_turn
