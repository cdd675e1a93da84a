// From one stream into another: whatever becomes of the other, the one that is played goes on.
#include "sdk/client/following/stream_change.hpp"

#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

constexpr StreamId kOther{1, 0};

/// A server that tells its world twice, as streams 0 and 1.
class StreamChangeTest : public ClientTest {
 protected:
  StreamChangeTest() {
    server.session.streams.push_back(server.session.streams[0]);
    server.session.streams[1].id = kOther;
  }
  [[nodiscard]] static transport::DeltaMessage of_other(transport::DeltaMessage delta) {
    delta.stream = kOther;
    return delta;
  }
  /// The same bodies as stream 0 has, cut as stream 1.
  [[nodiscard]] transport::SnapshotMessage other_snapshot() {
    transport::SnapshotMessage message = server.snapshot();
    auto timeline = std::move(*ClientTimeline::create(server.session.streams[1].layout));
    EXPECT_TRUE(timeline.load(message.bytes, message.epoch).has_value());
    timeline.rename(message.epoch, kOther);
    timeline.snapshot(message.bytes);
    message.total_bytes = static_cast<std::uint32_t>(message.bytes.size());
    message.stream = kOther;
    return message;
  }
};

class OneChange : public StreamChangeTest {
 protected:
  void SetUp() override {
    server.advance();
    load(*played, server.snapshot());
    load(change->to(), other_snapshot());
  }
  [[nodiscard]] std::unique_ptr<Follower> follow(std::size_t index) const {
    const transport::StreamMessage& stream = server.session.streams[index];
    return std::make_unique<Follower>(stream, std::move(*ClientTimeline::create(stream.layout)),
                                      server.session.frame_rate_hz, 0, 0);
  }
  void load(Follower& follower, const transport::SnapshotMessage& snapshot) {
    ASSERT_TRUE(follower.load(snapshot, port, 0).has_value());
  }
  void play(transport::DeltaMessage delta) {
    ASSERT_TRUE(played->take(std::move(delta), 0).done);
    ASSERT_TRUE(played->apply_front(scheduled, 0).done);
    played->pop();
  }
  void take_other(const transport::DeltaMessage& delta) {
    static_cast<void>(change->to().take(of_other(delta), 0));
  }

  ScheduledInputs scheduled;
  static bool never(const ClientTimeline&) { return false; }

  std::unique_ptr<Follower> played = follow(0);
  std::optional<StreamChange> change = StreamChange(follow(1), server.session.frame_rate_hz);
};

TEST_F(OneChange, IsDoneAtAFrameThatBothHave) {
  const auto first = server.advance(), second = server.advance();
  play(first);
  play(second);
  take_other(first);
  EXPECT_FALSE(change->catch_up(*played, scheduled, never).done);
  take_other(second);
  EXPECT_TRUE(change->catch_up(*played, scheduled, never).done);
  EXPECT_EQ(change->to().timeline().hash(), played->timeline().hash());
}

TEST_F(OneChange, DoesNotOvertakeTheOneThatIsPlayed) {
  const auto first = server.advance();
  take_other(first);
  take_other(server.advance());
  play(first);
  EXPECT_TRUE(change->catch_up(*played, scheduled, never).done);
  EXPECT_EQ(change->to().timeline().applied(), first.frame);
}

TEST_F(OneChange, DoesNotWaitForOneThatIsASecondBehind) {
  for (int i = 0; i < 40; ++i) {
    auto delta = server.advance();
    take_other(delta);
    ASSERT_TRUE(played->take(std::move(delta), 0).done);
  }
  EXPECT_TRUE(change->catch_up(*played, scheduled, never).done);
  EXPECT_EQ(change->to().timeline().applied(), played->timeline().applied() + StreamChange::kFramesPerPoll);
}

TEST_F(OneChange, AppliesOneFrameAtATimeWhereStepsTakeLong) {
  for (int i = 0; i < 3; ++i) {
    auto delta = server.advance();
    play(delta);
    take_other(delta);
  }
  const Frame before = change->to().timeline().applied();
  for (Frame done = 1; done <= 3; ++done) {
    EXPECT_EQ(change->catch_up(*played, scheduled, [](const ClientTimeline&) { return true; }).done,
              done == 3);
    EXPECT_EQ(change->to().timeline().applied(), before + done);
  }
}

TEST_F(OneChange, ReturnsWhatIsLostAndLeavesThePlayedStreamAsItIs) {
  const auto delta = server.advance();
  play(delta);
  auto wrong = delta;
  ++wrong.hash;
  take_other(wrong);
  const Follower::Step step = change->catch_up(*played, scheduled, never);
  EXPECT_FALSE(step.done);
  ASSERT_TRUE(step.loss);
  EXPECT_EQ(step.loss->reason, ResyncReason::kMismatch);
  change.reset();
  EXPECT_EQ(played->timeline().hash(), server.hashes.at(delta.frame));
  play(server.advance());
}

TEST_F(OneChange, IsGivenUpAfterTenSecondsInWhichTheServerWasHeard) {
  constexpr std::int64_t kS = 1000 * kMs;
  std::int64_t at_ns = 0;
  for (; at_ns <= 9 * kS; at_ns += kS) EXPECT_FALSE(change->gets_nowhere(at_ns, at_ns));
  for (; at_ns <= 60 * kS; at_ns += kS)
    EXPECT_FALSE(change->gets_nowhere(at_ns, 7 * kS)) << "silent altogether";
  EXPECT_FALSE(change->gets_nowhere(70 * kS, 70 * kS));
  EXPECT_TRUE(change->gets_nowhere(71 * kS, 71 * kS));
}

/// A client that finds both streams and has no wish for one.
class AClientThatFindsTwo : public StreamChangeTest {
 protected:
  void SetUp() override {
    server.session.streams[1].client_cost_ns = 70;  // dearer, so it promises fewer bits
    start();
    port.sessions.push_back(from_server(server.session));
    poll();
    ASSERT_EQ(core->phase(), ClientPhase::kJoining);
  }
  void tell(std::uint32_t stream, double mbit_per_s) {
    transport::ServerStatusMessage status;
    status.epoch = server.session.epoch;
    status.stream = stream;
    status.mbit_per_s = mbit_per_s;
    port.server_statuses.push_back(from_server(status));
  }
};

TEST_F(AClientThatFindsTwo, WaitsForWhatBothTakeAndJoinsTheOneOfFewerBits) {
  for (int i = 0; i < 10; ++i) poll(100 * kMs);
  EXPECT_TRUE(port.streams_open.empty());
  EXPECT_TRUE(port.acks.empty());
  tell(0, 0.03);
  poll();
  EXPECT_TRUE(port.streams_open.empty());
  tell(1, 0.22);
  poll();
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0}));
}

TEST_F(AClientThatFindsTwo, JoinsByWhatTheirStepsPromiseIfNothingIsToldIn1200Milliseconds) {
  for (int i = 0; i < 11; ++i) poll(100 * kMs);
  EXPECT_TRUE(port.streams_open.empty());
  for (int i = 0; i < 2; ++i) poll(100 * kMs);
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{1}));
}

TEST_F(AClientThatFindsTwo, SleepsWhileItWaits) {
  EXPECT_GE(core->poll({now_ns, wall_ns()}), now_ns + 40 * kMs);
}

TEST_F(AClientThatFindsTwo, WaitsForNothingOnceItNamesOne) {
  core->prefer("0");
  poll();
  poll();
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0}));
}

/// A client that plays stream 0 and has asked for a snapshot of stream 1.
class AClientThatChanges : public StreamChangeTest {
 protected:
  void SetUp() override {
    start();
    core->prefer("0");
    join();
    for (int i = 0; i < 3; ++i) frame();
    core->prefer("1");
    for (int i = 0; i < 40 && port.streams_open.count(1) == 0; ++i) frame();
    ASSERT_EQ(port.acks.back().stream, kOther);
    ASSERT_EQ(port.acks.back().phase, transport::Phase::kJoining);
    ASSERT_EQ(core->stream()->id, StreamId{});
  }
  void expect_to_stay() {
    EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
    EXPECT_EQ(core->stream()->id, StreamId{});
    EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0}));
    EXPECT_EQ(port.acks.back().stream, StreamId{});
    EXPECT_EQ(port.acks.back().phase, transport::Phase::kPlaying);
    const Frame last = core->timeline()->applied();
    for (int i = 0; i < 5; ++i) frame();
    EXPECT_EQ(core->timeline()->applied(), last + 5);
    EXPECT_EQ(core->timeline()->hash(), server.hashes.at(server.frame()));
    EXPECT_EQ(figures().resyncs, 0U);
    EXPECT_EQ(figures().stream_changes, 0U);
    EXPECT_TRUE(recorder.resyncs.empty());
  }
};

TEST_F(AClientThatChanges, MovesOverAndLosesNoFrame) {
  port.snapshots.push_back(from_server(other_snapshot()));
  const auto delta = server.advance();
  deliver(delta);
  deliver(of_other(delta));
  poll(kFrameNs);
  EXPECT_EQ(core->stream()->id, kOther);
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{1}));
  EXPECT_EQ(figures().stream_changes, 1U);
  deliver(of_other(server.advance()));
  poll(kFrameNs);
  expect_agreed();
  EXPECT_EQ(core->timeline()->applied(), server.frame());
}

TEST_F(AClientThatChanges, StaysWhenADeltaOfTheOtherStreamHasAWrongHash) {
  port.snapshots.push_back(from_server(other_snapshot()));
  const auto delta = server.advance();
  auto wrong = of_other(delta);
  ++wrong.hash;
  deliver(delta);
  deliver(std::move(wrong));
  poll(kFrameNs);
  EXPECT_EQ(figures().hash_mismatches, 1U);
  expect_to_stay();
}

TEST_F(AClientThatChanges, StaysWhenTheOtherStreamHasAGapOnceItsSnapshotIsLoaded) {
  // The other is a frame ahead, and so waits.
  const auto delta = server.advance();
  port.snapshots.push_back(from_server(other_snapshot()));
  deliver(of_other(delta));
  poll(kMs);
  ASSERT_EQ(core->stream()->id, StreamId{});
  ASSERT_TRUE(port.snapshots_open.empty()) << "it is loaded";
  const auto skipped = server.advance(), behind_it = server.advance();
  deliver(of_other(behind_it));
  deliver(delta);
  deliver(skipped);
  deliver(behind_it);
  poll(kFrameNs);
  expect_to_stay();
}

TEST_F(AClientThatChanges, JoinsTheOtherStreamWhenTheOneThatItPlaysIsLost) {
  server.advance();
  deliver(server.advance());
  poll(kFrameNs);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(core->stream()->id, kOther);
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{1}));
  EXPECT_EQ(figures().resyncs, 1U);
  deliver(of_other(server.advance()));
  port.snapshots.push_back(from_server(other_snapshot()));
  poll(kFrameNs);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  expect_agreed();
}

}  // namespace
}  // namespace tandem::client
