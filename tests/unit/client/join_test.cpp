#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

using JoinTest = ClientTest;

TEST_F(JoinTest, SubscribesToSnapshotsBeforeItSaysJoining) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  EXPECT_TRUE(!port.snapshots_open.empty());
  ASSERT_EQ(port.acks.size(), 1U);
  EXPECT_EQ(port.acks[0].phase, transport::Phase::kJoining);
  EXPECT_EQ(port.acks[0].join_attempt, 1U);
  EXPECT_EQ(port.acks[0].role_wanted, transport::Role::kParticipant);
}

TEST_F(JoinTest, AfterTheSnapshotItFollowsTheDeltasBufferedMeanwhile) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  for (int i = 0; i < 3; ++i) deliver(server.advance());
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  port.snapshots.push_back(from_server(server.snapshot()));  // of frame 3
  for (int i = 0; i < 2; ++i) deliver(server.advance());
  poll();
  EXPECT_EQ(core->timeline()->applied(), 5U);
  EXPECT_EQ(recorder.loaded, std::vector<Frame>{3});
  EXPECT_FALSE(!port.snapshots_open.empty());
  EXPECT_EQ(port.acks.back().phase, transport::Phase::kPlaying);
  EXPECT_EQ(port.acks.back().applied, 5U);
  expect_agreed();
}

TEST_F(JoinTest, ASnapshotInPartsIsJoinedAndAcknowledgementsNameWhatIsMissing) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  deliver(server.advance());
  const auto parts = split(server.snapshot(), 5);
  for (const std::size_t i : {1U, 3U}) port.snapshots.push_back(from_server(parts[i]));
  poll(60 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(port.acks.back().snapshot_frame, 1U);
  EXPECT_EQ(port.acks.back().snapshot_parts, 5U);
  EXPECT_EQ(port.acks.back().missing, (std::vector<std::uint32_t>{0, 1, 2, 1, 4, 1}));
  for (const std::size_t i : {0U, 1U, 2U}) port.snapshots.push_back(from_server(parts[i]));
  poll(60 * kMs);
  EXPECT_EQ(port.acks.back().missing, (std::vector<std::uint32_t>{4, 1}));
  port.snapshots.push_back(from_server(parts[4]));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(recorder.loaded, std::vector<Frame>{1});
  EXPECT_EQ(port.acks.back().snapshot_parts, 0U);
  frame();
  expect_agreed();
}

TEST_F(JoinTest, PartsOfAnotherStreamAreIgnored) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  deliver(server.advance());
  auto other = server.snapshot();
  other.stream.id = 1;
  port.snapshots.push_back(from_server(other));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
}

TEST_F(JoinTest, JoiningIsRepeatedUntilItPlays) {
  start();
  port.sessions.push_back(from_server(server.session));
  for (int i = 0; i < 40; ++i) poll(50 * kMs);
  EXPECT_GE(port.acks.size(), 8U);
  EXPECT_EQ(port.acks.back().join_attempt, 2U);
}

TEST_F(JoinTest, ASnapshotOlderThanTheBufferIsNotTaken) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  const auto old = server.snapshot();  // frame 0
  static_cast<void>(server.advance());
  deliver(server.advance());  // frame 2: frame 1 was never received
  port.snapshots.push_back(from_server(old));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
}

TEST_F(JoinTest, WhileTheServerIsSuspendedASnapshotAloneIsEnough) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  for (int i = 0; i < 7; ++i) static_cast<void>(server.advance());
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  poll(300 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(core->timeline()->applied(), 7U);
  frame();
  expect_agreed();
}

TEST_F(JoinTest, ScheduledInputsReceivedBeforeTheSnapshotAreNotLost) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  deliver(server.advance());
  const auto snapshot = server.snapshot();
  port.inputs.push_back(from_server(server.schedule(500)));  // after the snapshot's cut, before it arrives
  poll();
  port.snapshots.push_back(from_server(snapshot));
  poll();
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(core->timeline()->applied(), 6U);
  EXPECT_EQ(core->timeline()->drive().gravity[1], 500);
  expect_agreed();
}

TEST_F(JoinTest, ScheduledInputsThatTheSnapshotCountsAreNotNeededAgain) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  static_cast<void>(server.schedule(500));  // never reaches this client by its topic
  deliver(server.advance());
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(core->timeline()->applied(), 6U);
  expect_agreed();
}

TEST_F(JoinTest, MoreScheduledInputsThanMayWaitAtOnceCanComeWhileJoining) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  deliver(server.advance());
  const auto snapshot = server.snapshot();
  for (int i = 0; i < 300; ++i) {
    port.inputs.push_back(from_server(server.schedule(i)));
    deliver(server.advance());
  }
  poll();
  port.snapshots.push_back(from_server(snapshot));
  for (int i = 0; i < 5; ++i) poll();
  EXPECT_EQ(figures().refused_messages, 0U);
  ASSERT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(core->timeline()->applied(), 301U);
  expect_agreed();
}

TEST_F(JoinTest, WhatIsHeldCanBeDrawnAfterASnapshotWasRefused) {
  join();
  for (int i = 0; i < 3; ++i) frame();
  static_cast<void>(server.advance());
  frame();  // a gap
  ASSERT_EQ(core->phase(), ClientPhase::kJoining);
  auto broken = server.snapshot();
  broken.bytes[51] ^= std::byte{1};  // of the state hash
  poll(300 * kMs);
  port.snapshots.push_back(from_server(broken));
  poll();
  ASSERT_EQ(figures().refused_messages, 1U);
  core->start_sampling();
  Sample sample;
  EXPECT_TRUE(core->sample(sample, SampleMode::kExtrapolate, {now_ns, wall_ns()}));
}

TEST_F(JoinTest, AGapWhileJoiningStartsTheBufferAgainBehindIt) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  deliver(server.advance());
  const auto snapshot = server.snapshot();
  static_cast<void>(server.advance());
  deliver(server.advance());
  port.snapshots.push_back(from_server(snapshot));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(figures().resyncs, 0U);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  EXPECT_EQ(core->timeline()->applied(), 3U);
}

TEST_F(JoinTest, TooManyDeltasWhileJoiningStartAgainWithANewQuestion) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  for (int i = 0; i < (1 << 14) + 100; ++i) deliver(server.advance());
  poll();
  ASSERT_FALSE(recorder.resyncs.empty());
  EXPECT_EQ(recorder.resyncs[0], ResyncReason::kOverflow);
  poll(250 * kMs);
  EXPECT_EQ(core->join_attempt(), 2U);
  EXPECT_EQ(figures().queue_high_water, 1U << 14U);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
}

TEST_F(JoinTest, JoinTimeCountsFromLearningTheSession) {
  start();
  poll(10'000 * kMs);
  port.sessions.push_back(from_server(server.session));
  poll();
  deliver(server.advance());
  port.snapshots.push_back(from_server(server.snapshot()));
  poll(80 * kMs);
  EXPECT_EQ(figures().join_ns, 80 * kMs);
}

TEST_F(JoinTest, ALeadAboveTheSessionsIsClampedAndReported) {
  FakeServer strict(1000, 40, 0);
  start(1);
  port.sessions.push_back(from_server(strict.session));
  poll();
  EXPECT_EQ(core->status().lead, 0U);
  EXPECT_NE(log.at(0).find("the session allows a lead of 0, not 1"), std::string::npos);
}

}  // namespace
}  // namespace tandem::client
