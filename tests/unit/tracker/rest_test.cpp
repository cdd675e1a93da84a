// Bodies of the full simulation that stand still, whatever the predictor, the threshold and gravity.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tests/unit/timeline/session.hpp"

namespace tandem::of_rest {
namespace {

using namespace synthetic;

constexpr std::int32_t kThreshold = 2048;
constexpr std::uint32_t kBodies = 64;

Layout layout_of(std::string_view predictor, std::uint32_t capacity = kBodies) {
  Layout layout = layout_for("tracker", capacity);
  layout.parameters.codec.threshold = kThreshold;
  layout.predictor = predictor;
  if (predictor != "ballistic") {
    ContactConstants constants;
    constants.types.resize(kTypes);
    layout.predictor_constants = write_contact_constants(constants);
  }
  return layout;
}

Drive gravity_of(std::int32_t size) { return {{0, -size, 0}, 30}; }

// Bodies in a row, far from each other, that stand.
State standing() {
  State state(kBodies);
  for (Slot slot = 0; slot < kBodies; ++slot)
    state.spawn(slot, 0, 0, {{static_cast<std::int32_t>(slot) * 500'000, 77, -3}, {}});
  return state;
}

// Corrections of `frames` frames towards `target`; the client follows.
std::uint32_t corrections(ServerTimeline& server, ClientTimeline& client, const State& target, int frames) {
  std::uint32_t sum = 0;
  for (int i = 0; i < frames; ++i) {
    const auto frame = server.advance(target, {});
    sum += frame.corrected;
    const auto applied = apply(client, frame);
    EXPECT_TRUE(applied) << applied.error().message;
    client.step(1);
  }
  return sum;
}

TEST(Rest, ABodyThatStandsIsCorrectedTwiceAndThenNeverAgain) {
  for (const std::string_view predictor : {"ballistic", "field", "contact"}) {
    for (const double ratio : {0.0, 0.1, 0.5, 1.0, 3.0, 10.0, 30.0}) {
      SCOPED_TRACE(std::string(predictor) + " " + std::to_string(ratio));
      const Layout layout = layout_of(predictor);
      auto server = server_of(layout);
      auto client = client_of(layout);
      const State target = standing();
      server.start(0, target, gravity_of(static_cast<std::int32_t>(64 * kThreshold * ratio)));
      ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
      EXPECT_LE(corrections(server, client, target, 30), 2 * kBodies);
      EXPECT_EQ(corrections(server, client, target, 600), 0U);
      EXPECT_EQ(server.advance(target, {}).payload.size(), 0U);
      EXPECT_EQ(server.state().rest_count(), ratio == 0 ? 0 : kBodies);
    }
  }
}

TEST(Rest, ABodyThatTremblesRestsAllTheSame) {
  Random random(5);
  const Layout layout = layout_of("ballistic");
  auto server = server_of(layout);
  const State start = standing();
  server.start(0, start, gravity_of(64 * kThreshold));
  std::uint32_t late = 0;
  for (int i = 0; i < 400; ++i) {
    State target = start;
    for (Slot slot = 0; slot < kBodies; ++slot) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        target.p(axis)[slot] += static_cast<std::int32_t>(random.below(101)) - 50;
    }
    const auto frame = server.advance(target, {});
    if (i >= 30) late += frame.corrected;
  }
  EXPECT_EQ(late, 0U);
}

TEST(Rest, GravityThatChangesWakesAndABodyAtTheTopOfItsThrowIsAwake) {
  const Layout layout = layout_of("ballistic");
  auto server = server_of(layout);
  auto client = client_of(layout);
  const State target = standing();
  server.start(0, target, gravity_of(6400));
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  corrections(server, client, target, 40);
  ASSERT_EQ(server.state().rest_count(), kBodies);
  // One more gravity than before, in the frame after the next.
  const ScheduledDrive input{1, server.frame() + 2, {{640, -6400, 0}, 30}};
  ASSERT_TRUE(server.schedule(input));
  ASSERT_TRUE(client.schedule(input));
  corrections(server, client, target, 1);
  EXPECT_EQ(server.state().rest_count(), kBodies);
  corrections(server, client, target, 1);
  EXPECT_EQ(server.state().rest_count(), 0U);
  corrections(server, client, target, 60);
  EXPECT_EQ(server.state().rest_count(), kBodies);

  // Thrown up, but told wrongly: each is corrected all the way, and none is thought to rest at the top.
  auto other = server_of(layout);
  State thrown = target;
  other.start(0, target, gravity_of(640));
  std::uint32_t resting = 0;
  for (int i = 0; i < 60; ++i) {
    for (Slot slot = 0; slot < kBodies; ++slot) {
      thrown.v(1)[slot] = 640 * (30 - i);
      thrown.p(1)[slot] += thrown.v(1)[slot] / 64;
      thrown.p(0)[slot] += i % 7 == 0 ? kThreshold / 16 : 0;
    }
    other.advance(thrown, {});
    resting += other.state().rest_count();
  }
  EXPECT_EQ(resting, 0U);
}

TEST(Rest, NothingOverflowsAtTheLimitsOfTheLattice) {  // undefined behaviour once made compilers disagree
  const Layout layout = layout_of("ballistic", 1);
  auto server = server_of(layout);
  State target(1);
  target.spawn(0, 0, 0, {{kPositionLimit, kPositionLimit, kPositionLimit}, {}});
  server.start(0, target, {{kVelocityLimit, -kVelocityLimit, kVelocityLimit}, 0});
  for (int i = 0; i < 8; ++i) {
    const std::int32_t side = i / 2 % 2 == 0 ? kPositionLimit : -kPositionLimit;
    target.set_body(0, {{side, -side, side}, {}});
    server.advance(target, {});
  }
  EXPECT_EQ(server.state().alive_count(), 1U);
}

TEST(Rest, SurvivesASnapshotAndEndsWithTheBody) {
  const Layout layout = layout_of("field");
  auto server = server_of(layout);
  auto client = client_of(layout);
  State target = standing();
  server.start(0, target, gravity_of(64 * kThreshold));
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  corrections(server, client, target, 40);
  auto late = client_of(layout);
  ASSERT_TRUE(late.load(snapshot_of(server), kEpoch));
  EXPECT_EQ(late.state(server.frame()), server.state());
  EXPECT_EQ(late.state(server.frame()).rest_count(), kBodies);
  const LifecycleRecord gone{LifecycleKind::kDespawn, 3, 0, 0, {}};
  const LifecycleRecord elsewhere{LifecycleKind::kTeleport, 5, 0, 0, {{9'000'000, 9'000'000, 0}, {}}};
  target.despawn(3);
  target.set_body(5, elsewhere.body);
  const std::vector<LifecycleRecord> lifecycle{gone, elsewhere};
  const auto frame = server.advance(target, lifecycle);
  EXPECT_TRUE(apply(client, frame));
  EXPECT_TRUE(apply(late, frame));
  EXPECT_EQ(server.state().rest_count(), kBodies - 2);
  EXPECT_EQ(client.state(server.frame()), server.state());
}

}  // namespace
}  // namespace tandem::of_rest
