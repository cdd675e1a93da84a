#include <gtest/gtest.h>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "tests/unit/timeline/session.hpp"

namespace tandem {
namespace {

using namespace synthetic;

/// A server one frame after the client's snapshot, and that client.
struct Pair {
  explicit Pair(std::uint32_t max_lead = 1, std::string_view codec = "entropy")
      : server(server_of(layout_for(codec, 40, max_lead))),
        client(client_of(layout_for(codec, 40, max_lead))) {
    server.start(10, random_state(random, 40), Drive{{0, -640, 0}, 10});
    EXPECT_TRUE(client.load(snapshot_of(server), kEpoch));
  }
  ServerTimeline::FrameResult frame() { return server.advance(random_target(random, server.state(), 4), {}); }

  Random random{5};
  ServerTimeline server;
  ClientTimeline client;
};

TEST(ClientTimeline, FollowsTheServerWithEveryCodec) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    Pair pair(1, codec);
    for (int i = 0; i < 30; ++i) {
      pair.client.step(1);
      const auto applied = apply(pair.client, pair.frame());
      ASSERT_TRUE(applied) << applied.error().message;
      ASSERT_EQ(pair.client.state(pair.client.applied()), pair.server.state());
      ASSERT_EQ(pair.client.hash(), pair.server.hash());
    }
  }
}

TEST(ClientTimeline, WhatIsPreparedIsSeenOnceItIsSteppedAndFollowsInputsThatComeLater) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    Pair pair(1, codec);
    for (int i = 0; i < 10; ++i) {
      pair.client.prepare();
      EXPECT_EQ(pair.client.now(), pair.client.applied());
      const Drive drive{{0, -100 * i, 0}, 10};
      const std::uint64_t number = pair.server.last_input() + 1;
      ASSERT_TRUE(pair.server.schedule({number, pair.server.frame() + 1, drive}));
      ASSERT_TRUE(pair.client.schedule({number, pair.server.frame() + 1, drive}));
      if (i % 2 == 0) {
        EXPECT_TRUE(pair.client.step(1));
        pair.client.prepare();  // nothing is left to prepare
        EXPECT_EQ(pair.client.now(), pair.client.applied() + 1);
      }
      const auto applied = apply(pair.client, pair.frame());
      ASSERT_TRUE(applied) << applied.error().message;
      ASSERT_EQ(pair.client.state(pair.client.applied()), pair.server.state());
    }
  }
}

TEST(ClientTimeline, ARefusedDeltaLeavesWhatIsPrepared) {
  for (const std::uint32_t lead : {0U, 1U, 2U}) {
    Pair pair(lead, "tracker");
    for (int i = 0; i < 10; ++i) {
      pair.client.prepare();
      pair.client.step(lead);
      pair.client.step(lead);
      const std::array<std::byte, 3> nonsense{std::byte{0xFF}, std::byte{0xFF}, std::byte{0xFF}};
      EXPECT_EQ(pair.client.apply(pair.client.applied() + 1, 0, 0, nonsense).error().code,
                ErrorCode::kMalformed);
      const auto applied = apply(pair.client, pair.frame());
      ASSERT_TRUE(applied) << applied.error().message;
      ASSERT_EQ(pair.client.state(pair.client.applied()), pair.server.state());
    }
  }
}

TEST(ClientTimeline, ASnapshotIsLoadedOverWhatIsPrepared) {
  Pair pair;
  pair.client.prepare();
  static_cast<void>(pair.frame());
  ASSERT_TRUE(pair.client.load(snapshot_of(pair.server), kEpoch));
  pair.client.prepare();
  ASSERT_TRUE(apply(pair.client, pair.frame()));
  EXPECT_EQ(pair.client.state(pair.client.applied()), pair.server.state());
}

TEST(ClientTimeline, ItsSnapshotIsTheServersToTheByte) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    Pair pair(1, codec);
    for (int i = 0; i < 5; ++i) {
      const Drive drive{{0, -100 * i, 0}, 10};
      const std::uint64_t number = pair.server.last_input() + 1;
      ASSERT_TRUE(pair.server.schedule({number, pair.server.frame() + 2, drive}));
      ASSERT_TRUE(pair.client.schedule({number, pair.server.frame() + 2, drive}));
      pair.client.step(1);
      ASSERT_TRUE(apply(pair.client, pair.frame()));
      std::vector<std::byte> bytes;
      pair.client.snapshot(bytes);
      ASSERT_EQ(bytes, snapshot_of(pair.server));
    }
  }
}

TEST(ClientTimeline, ItsSnapshotLeavesOutInputsBeyondAGap) {
  Pair pair;
  ASSERT_TRUE(pair.client.schedule({2, 13, {}}));
  std::vector<std::byte> bytes;
  pair.client.snapshot(bytes);
  EXPECT_EQ(bytes, snapshot_of(pair.server));
}

TEST(ClientTimeline, WhatIsPassedUnreadNeedsASnapshotBeforeItIsReadAgain) {
  Pair pair;
  pair.client.prepare();
  const Frame begun = pair.client.applied();
  EXPECT_TRUE(pair.client.holds_state());
  for (int i = 0; i < 3; ++i) {
    const auto frame = pair.frame();
    EXPECT_EQ(pair.client.pass(frame.frame + 1, frame.last_input, frame.hash).error().code,
              ErrorCode::kOutOfOrder);
    ASSERT_TRUE(pair.client.pass(frame.frame, frame.last_input, frame.hash));
    EXPECT_EQ(pair.client.hash(), frame.hash);
    pair.client.prepare();
    EXPECT_FALSE(pair.client.step(1));
  }
  EXPECT_FALSE(pair.client.holds_state());
  EXPECT_EQ(pair.client.applied(), begun + 3);
  EXPECT_EQ(apply(pair.client, pair.frame()).error().code, ErrorCode::kOutOfOrder);
  ASSERT_TRUE(pair.client.load(snapshot_of(pair.server), kEpoch));
  EXPECT_TRUE(pair.client.holds_state());
  ASSERT_TRUE(apply(pair.client, pair.frame()));
  EXPECT_EQ(pair.client.state(pair.client.applied()), pair.server.state());
}

TEST(ClientTimeline, HoldsNothingBeforeASnapshot) {
  auto client = client_of(layout_for("entropy", 4));
  EXPECT_FALSE(client.playing());
  EXPECT_FALSE(client.step(1));
  EXPECT_EQ(client.apply(1, 0, 0, {}).error().code, ErrorCode::kOutOfOrder);
  EXPECT_EQ(client.schedule({1, 1, {}}).error().code, ErrorCode::kOutOfOrder);
}

TEST(ClientTimeline, SimulatesAheadNoFurtherThanItsLeadOrTheSessions) {
  Pair pair(2);
  EXPECT_FALSE(pair.client.step(0));
  EXPECT_TRUE(pair.client.step(1));
  EXPECT_FALSE(pair.client.step(1));
  EXPECT_TRUE(pair.client.step(9));
  EXPECT_FALSE(pair.client.step(9));
  EXPECT_EQ(pair.client.applied(), 10U);
  EXPECT_EQ(pair.client.now(), 12U);
}

TEST(ClientTimeline, WhatItSimulatedAheadIsSimulatedAgainAfterADelta) {
  Pair pair(3);
  while (pair.client.step(3)) continue;
  ASSERT_TRUE(apply(pair.client, pair.frame()));
  State expected = pair.server.state();
  for (Frame frame = 12; frame <= 13; ++frame) {
    Ballistic().step(expected, expected, {pair.server.drive(), {}});
    EXPECT_EQ(pair.client.state(frame), expected) << "frame " << frame;
  }
}

TEST(ClientTimeline, ADeltaOutOfOrderIsRefused) {
  Pair pair;
  const auto first = pair.frame();
  const std::vector<std::byte> payload(first.payload.begin(), first.payload.end());
  EXPECT_EQ(pair.client.apply(first.frame + 1, 0, first.hash, payload).error().code, ErrorCode::kOutOfOrder);
  EXPECT_EQ(pair.client.apply(first.frame - 1, 0, first.hash, payload).error().code, ErrorCode::kOutOfOrder);
  EXPECT_TRUE(pair.client.apply(first.frame, 0, first.hash, payload));
  EXPECT_EQ(pair.client.apply(first.frame, 0, first.hash, payload).error().code, ErrorCode::kOutOfOrder);
}

TEST(ClientTimeline, ADeltaWaitsForTheInputsItCounts) {
  Pair pair;
  const ScheduledDrive input{1, 12, Drive{{0, 640, 0}, 0}};
  ASSERT_TRUE(pair.server.schedule(input));
  const auto first = pair.frame();
  EXPECT_LT(pair.client.inputs_held(), first.last_input);
  EXPECT_EQ(apply(pair.client, first).error().code, ErrorCode::kOutOfOrder);
  ASSERT_TRUE(pair.client.schedule(input));
  EXPECT_TRUE(apply(pair.client, first));
  EXPECT_TRUE(apply(pair.client, pair.frame()));
  EXPECT_EQ(pair.client.drive(), input.drive);
}

TEST(ClientTimeline, AnInputForAFrameAlreadySimulatedChangesThatFrame) {
  Pair pair(2);
  pair.client.step(2);
  pair.client.step(2);
  const ScheduledDrive input{1, 12, Drive{{0, 6400, 0}, 0}};
  ASSERT_TRUE(pair.client.schedule(input));
  State expected = pair.client.state(11);
  Ballistic().step(expected, expected, {input.drive, {}});
  EXPECT_EQ(pair.client.state(12), expected);
}

TEST(ClientTimeline, ARefusedDeltaLeavesEverythingAsItWas) {
  for (const bool ahead : {false, true}) {
    Pair pair;
    if (ahead) pair.client.step(1);
    const Frame now = pair.client.now();
    const State before = pair.client.state(now);
    const auto frame = pair.frame();
    std::vector<std::byte> cut(frame.payload.begin(), frame.payload.end() - 1);
    EXPECT_EQ(pair.client.apply(frame.frame, 0, frame.hash, cut).error().code, ErrorCode::kMalformed);
    EXPECT_EQ(pair.client.applied(), 10U);
    EXPECT_EQ(pair.client.now(), now);
    EXPECT_EQ(pair.client.state(now), before);
    EXPECT_TRUE(apply(pair.client, frame));
  }
}

TEST(ClientTimeline, AWrongHashIsReportedAndASnapshotHealsIt) {
  Pair pair;
  const auto frame = pair.frame();
  EXPECT_EQ(pair.client.apply(frame.frame, 0, frame.hash ^ 1U, frame.payload).error().code,
            ErrorCode::kMismatch);
  ASSERT_TRUE(pair.client.load(snapshot_of(pair.server), kEpoch));
  EXPECT_TRUE(apply(pair.client, pair.frame()));
}

TEST(ClientTimeline, ASnapshotBringsTheInputsStillToAct) {
  Pair pair;
  const ScheduledDrive input{1, 13, Drive{{0, 640, 0}, 0}};
  ASSERT_TRUE(pair.server.schedule(input));
  pair.frame();
  ASSERT_TRUE(pair.client.load(snapshot_of(pair.server), kEpoch));
  EXPECT_EQ(pair.client.inputs_held(), 1U);
  EXPECT_TRUE(pair.client.schedule(input)) << "a late copy is ignored";
  EXPECT_TRUE(apply(pair.client, pair.frame()));
  EXPECT_TRUE(apply(pair.client, pair.frame()));
  EXPECT_EQ(pair.client.drive(), input.drive);
}

TEST(ClientTimeline, ASnapshotBringsTheParametersInForce) {
  Pair pair;
  pair.server.set_parameters({{77, 3, 5}});
  pair.frame();
  ASSERT_TRUE(pair.client.load(snapshot_of(pair.server), kEpoch));
  EXPECT_EQ(pair.client.parameters(), (StreamParameters{{77, 3, 5}}));
  EXPECT_TRUE(apply(pair.client, pair.frame()));
}

TEST(ClientTimeline, ASnapshotOfAnotherEpochIsRefusedAndNothingIsHeld) {
  Pair pair;
  EXPECT_EQ(pair.client.load(snapshot_of(pair.server), kEpoch + 1).error().code, ErrorCode::kOutOfOrder);
  EXPECT_FALSE(pair.client.playing());
}

TEST(ClientTimeline, LifecycleAndTouchedSlotsOfTheLastDeltaCanBeAsked) {
  Pair pair;
  Slot dead = 0;
  while (pair.server.state().alive()[dead] != 0) ++dead;
  State target = pair.server.state();
  const LifecycleRecord spawn{LifecycleKind::kSpawn, dead, 3, 1, {{5, 6, 7}, {}}};
  target.spawn(dead, 3, 1, spawn.body);
  const std::vector<LifecycleRecord> records{spawn};
  ASSERT_TRUE(apply(pair.client, pair.server.advance(target, records)));
  ASSERT_EQ(pair.client.lifecycle().size(), 1U);
  EXPECT_EQ(pair.client.lifecycle()[0].slot, dead);
  const auto touched = pair.client.touched();
  EXPECT_TRUE(std::find(touched.begin(), touched.end(), dead) != touched.end());
  const auto corrected = pair.client.corrected();
  EXPECT_TRUE(std::find(corrected.begin(), corrected.end(), dead) == corrected.end());
  EXPECT_EQ(pair.client.state(pair.client.applied()).reuse()[dead], 3);
}

}  // namespace
}  // namespace tandem
