// Viewers that come back over another connection.

#include "services/gateway/gateway.hpp"

#include "fake_world.hpp"

namespace tandem::gateway {
namespace {

using transport::DeltaMessage;
using transport::Phase;
using transport::ScheduledInputMessage;
using transport::SnapshotMessage;

class Resuming : public GatewayTest {
 protected:
  /// A connection of a viewer that plays and holds this frame.
  ViewerId comes_back(transport::ClientId client, Frame holds) {
    const ViewerId id = *gateway.admit();
    read(id);
    says(id, client, holds);
    return id;
  }
  void says(ViewerId id, transport::ClientId client, Frame holds) {
    auto message = ack(client, Phase::kPlaying);
    message.applied = holds;
    EXPECT_FALSE(say(id, message));
  }
  void input(std::uint64_t number) {
    transport::ScheduledInputMessage message;
    message.epoch = kEpoch;
    message.number = number;
    message.frame = world.frame + 2;
    gateway.on_scheduled(message, now_ns);
  }
  std::vector<Frame> frames(ViewerId id) {
    const auto got = read(id);
    EXPECT_TRUE(only<SnapshotMessage>(got).empty());
    std::vector<Frame> out;
    for (const DeltaMessage& delta : only<DeltaMessage>(got)) out.push_back(delta.frame);
    return out;
  }
};

TEST_F(Resuming, WhoHoldsAFrameGetsThoseBehindIt) {
  gateway.on_session(fake_session());
  for (int i = 0; i < 8; ++i) frame();
  const ViewerId id = comes_back(7, 5);
  EXPECT_EQ(frames(id), (std::vector<Frame>{6, 7, 8}));
  frame();
  EXPECT_EQ(frames(id), (std::vector<Frame>{9}));
  EXPECT_EQ(gateway.counts().resumed, 1U);
  EXPECT_EQ(world.cuts, 0);
}

TEST_F(Resuming, TheInputsThatItLacksAreAmongThem) {
  gateway.on_session(fake_session());
  frame();
  input(1);
  frame();
  world.last_input = 1;
  frame();
  const auto got = read(comes_back(7, 2));
  ASSERT_EQ(only<ScheduledInputMessage>(got).size(), 1U);
  ASSERT_EQ(only<DeltaMessage>(got).size(), 1U) << "frame 2, between them, it has";
  EXPECT_EQ(only<DeltaMessage>(got).back().frame, 3U);
}

TEST_F(Resuming, ThirtySecondsOfFramesAreNotTooMany) {
  gateway.on_session(fake_session());
  frame();
  world.snapshot.resize(1000);
  join(1);  // so that the size of a snapshot is known
  const Frame held = world.frame;
  for (int i = 0; i < 870; ++i) frame(200);
  const ViewerId id = comes_back(7, held);
  EXPECT_EQ(frames(id).size(), 870U) << "29 s, larger than a snapshot";
  EXPECT_EQ(gateway.counts().skips, 0U);
}

TEST_F(Resuming, AViewerThatIsSlowAfterwardsIsBehindAsAnyOther) {
  gateway.on_session(fake_session());
  frame();
  world.snapshot.resize(1000);
  join(1);
  const ViewerId id = comes_back(7, world.frame);
  frame(100'000);
  read(id);
  for (int i = 0; i < 60; ++i) frame(10'000);
  EXPECT_EQ(frames(id), (std::vector<Frame>{world.frame}));
  EXPECT_EQ(gateway.counts().skips, 1U);
}

TEST_F(Resuming, WhatIsOlderThanTheLogEndsInAGap) {
  gateway.on_session(fake_session());
  for (int i = 0; i < 8; ++i) frame();
  later(31 * kSecond);
  frame();
  frame();
  const ViewerId id = comes_back(7, 4);
  EXPECT_EQ(frames(id), (std::vector<Frame>{10}));
  EXPECT_EQ(gateway.counts().resumed, 0U);
}

TEST_F(Resuming, AGatewayThatIsBehindCatchesUpFirst) {
  gateway.on_session(fake_session());
  const ViewerId id = comes_back(7, 4);
  EXPECT_TRUE(frames(id).empty());
  world.frame = 2;  // it goes on from a state of frame 2
  frame();
  EXPECT_TRUE(frames(id).empty());
  frame();
  frame();
  EXPECT_EQ(frames(id), (std::vector<Frame>{5}));
  EXPECT_EQ(gateway.counts().resumed, 1U);
  const ViewerId other = comes_back(8, 2);
  EXPECT_EQ(frames(other), (std::vector<Frame>{3, 4, 5}));
}

TEST_F(Resuming, WhoWaitsAndThenAsksForASnapshotGetsOne) {
  gateway.on_session(fake_session());
  const ViewerId id = comes_back(7, 1000);
  frame();
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
  later(accounts::kSnapshotSpacingNs);
  EXPECT_FALSE(only<SnapshotMessage>(read(id)).empty());
  frame();
  EXPECT_EQ(frames(id), (std::vector<Frame>{2}));
}

TEST_F(Resuming, AFrameThatNeverWasIsWaitedForWithoutWork) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = comes_back(7, UINT64_MAX);
  for (int i = 0; i < 10; ++i) frame();
  EXPECT_TRUE(frames(id).empty());
  EXPECT_EQ(gateway.counts().resumed, 0U);
}

}  // namespace
}  // namespace tandem::gateway
