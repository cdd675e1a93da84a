// Bytes that are wrong in every way: counted, never in the state, and the client plays again.
#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

class HostileTest : public ClientTest {
 protected:
  /// Lets the client join again and proves that it then holds the server's state.
  void recover() {
    for (int i = 0; i < 20 && core->phase() != ClientPhase::kPlaying; ++i) {
      port.snapshots.push_back(from_server(server.snapshot()));
      frame(100 * kMs);
    }
    ASSERT_EQ(core->phase(), ClientPhase::kPlaying);
    for (int i = 0; i < 3; ++i) frame();
    ASSERT_EQ(core->timeline()->applied(), server.frame());
    EXPECT_EQ(core->timeline()->hash(), server.hashes.at(server.frame()));
  }
  /// So many frames that what went wrong before does not count any more.
  void settle() {
    for (std::uint64_t i = 0; i < FollowedEpoch::kSettledFrames; ++i) frame();
  }
  void expect_no_wrong_frame() const {
    for (const auto& [frame, hash] : recorder.hashes)
      EXPECT_EQ(hash, server.hashes.at(frame)) << "frame " << frame;
  }
};

TEST_F(HostileTest, ATruncatedDeltaIsRefusedAndTheClientJoinsAgain) {
  join();
  auto delta = server.advance();
  delta.payload.resize(delta.payload.size() / 2);
  deliver(delta);
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(figures().refused_messages, 1U);
  EXPECT_EQ(figures().resyncs, 1U);
  recover();
  expect_no_wrong_frame();
}

TEST_F(HostileTest, AWrongHashIsAMismatchAndTheClientJoinsAgain) {
  join();
  auto delta = server.advance();
  delta.hash ^= 1;
  deliver(delta);
  poll();
  EXPECT_EQ(figures().hash_mismatches, 1U);
  EXPECT_EQ(recorder.resyncs, std::vector<ResyncReason>{ResyncReason::kMismatch});
  recover();
  expect_no_wrong_frame();
}

TEST_F(HostileTest, AStreamThatComesOutOtherwiseAfterEachSnapshotIsLeft) {
  join();
  for (std::uint32_t wrong = 0; wrong < FollowedEpoch::kMaxWrongJoins; ++wrong) {
    ASSERT_NE(core->phase(), ClientPhase::kRefused) << wrong;
    if (wrong > 0) recover();
    auto delta = server.advance();
    delta.hash ^= 1;
    deliver(delta);
    poll();
  }
  poll(kFrameNs);
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  EXPECT_NE(core->status().reason.find("differently from the server"), std::string::npos);
  const auto attempts = core->join_attempt();
  for (int i = 0; i < 300; ++i) frame();
  EXPECT_EQ(core->join_attempt(), attempts) << "it does not ask for snapshots for ever";
}

TEST_F(HostileTest, AMismatchNowAndThenIsNoReasonToLeave) {
  join();
  for (std::uint32_t wrong = 0; wrong < 2 * FollowedEpoch::kMaxWrongJoins; ++wrong) {
    settle();
    auto delta = server.advance();
    delta.hash ^= 1;
    deliver(delta);
    poll();
    recover();
  }
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
}

TEST_F(HostileTest, AnyMutatedDeltaIsCaughtBeforeItCounts) {
  constexpr std::uint64_t kSeed = 20'240'601;
  RecordProperty("seed", std::to_string(kSeed));
  std::uint64_t random = kSeed;
  const auto next = [&] {
    random ^= random << 13U;
    random ^= random >> 7U;
    random ^= random << 17U;
    return random;
  };
  join();
  for (int i = 0; i < 300; ++i) {
    auto delta = server.advance();
    const auto before = delta.payload;
    for (std::uint64_t flips = 1 + next() % 4; flips > 0 && !delta.payload.empty(); --flips) {
      delta.payload[next() % delta.payload.size()] ^= static_cast<std::byte>(1U << (next() % 8));
    }
    if (next() % 5 == 0) delta.payload.resize(next() % (delta.payload.size() + 20));
    const bool changed = delta.payload != before;
    deliver(delta);
    poll(kFrameNs);
    if (changed) {
      ASSERT_EQ(core->phase(), ClientPhase::kJoining) << "mutation " << i;
      recover();
      settle();
    }
  }
  expect_no_wrong_frame();
  EXPECT_EQ(figures().resyncs, figures().hash_mismatches + figures().refused_messages);
}

// A value that the state hash does not cover (the drive, say) shows in the hash of the next delta at the
// latest.
TEST_F(HostileTest, AnyMutatedSnapshotIsRefusedOrFoundOutByTheNextDeltas) {
  constexpr std::uint64_t kSeed = 20'240'602;
  RecordProperty("seed", std::to_string(kSeed));
  std::uint64_t random = kSeed;
  const auto next = [&] {
    random ^= random << 13U;
    random ^= random >> 7U;
    random ^= random << 17U;
    return random;
  };
  join();
  for (int i = 0; i < 500; ++i) {
    static_cast<void>(server.advance());
    frame(kFrameNs);  // a gap: joins again
    ASSERT_EQ(core->phase(), ClientPhase::kJoining) << "mutation " << i;
    poll(400 * kMs);
    auto snapshot = server.snapshot();
    snapshot.bytes[next() % snapshot.bytes.size()] ^= static_cast<std::byte>(1U << (next() % 8));
    if (next() % 5 == 0) snapshot.bytes.resize(next() % snapshot.bytes.size());
    port.snapshots.push_back(from_server(snapshot));
    for (int k = 0; k < 3; ++k) frame();
    recover();
    settle();
  }
  expect_no_wrong_frame();
  EXPECT_GT(figures().refused_messages, 400U);
}

TEST_F(HostileTest, ASnapshotOfAnotherFrameOrEpochThanItSaysIsRefused) {
  start();
  port.sessions.push_back(from_server(server.session));
  poll();
  deliver(server.advance());
  auto snapshot = server.snapshot();
  snapshot.frame += 1;
  port.snapshots.push_back(from_server(snapshot));
  poll();
  EXPECT_EQ(figures().refused_messages, 1U);
  FakeServer other(2000);
  static_cast<void>(other.advance());
  snapshot = other.snapshot();
  snapshot.epoch = 1000;
  port.snapshots.push_back(from_server(snapshot));
  poll();
  EXPECT_EQ(figures().refused_messages, 2U);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  recover();
}

TEST_F(HostileTest, DeltasAndSnapshotsOfAnotherEpochAreCountedAndIgnored) {
  join();
  auto delta = server.advance();
  auto stale = delta;
  stale.epoch = 999;
  deliver(stale);
  deliver(delta);
  poll();
  EXPECT_EQ(figures().stale_messages, 1U);
  EXPECT_EQ(core->timeline()->applied(), 2U);
  EXPECT_EQ(figures().resyncs, 0U);
}

TEST_F(HostileTest, AMalformedScheduledInputStaysMissingAndTheClientJoinsAgain) {
  join();
  const auto good = server.schedule(600);
  for (int i = 0; i < 6; ++i) {
    auto bad = good;
    if (i == 0) bad.kind = 99;
    if (i == 1) bad.values.pop_back();
    if (i == 2) bad.values[1] = kVelocityLimit + 1;
    if (i == 3) bad.values[3] = -1;
    if (i == 4) bad.values[3] = 65'536;
    if (i == 5) bad.number = 0;
    port.inputs.push_back(from_server(bad));
  }
  frame();
  EXPECT_EQ(figures().refused_messages, 6U);
  for (int i = 0; i < 10; ++i) poll(40 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  recover();
  expect_no_wrong_frame();
}

TEST_F(HostileTest, AScheduledInputForAnAppliedFrameBringsARejoin) {
  join();
  for (int i = 0; i < 5; ++i) frame();
  auto late = server.schedule(600);
  late.frame = 2;
  port.inputs.push_back(from_server(late));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying) << "no delta has counted it yet";
  frame();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(figures().refused_messages, 1U);
  recover();
}

TEST_F(HostileTest, AFloodOfScheduledInputsThatNoDeltaCountsChangesNothing) {
  join();
  for (std::uint64_t n = 1; n <= 5000; ++n) {
    transport::ScheduledInputMessage input;
    input.epoch = 1000;
    input.number = n + 1'000'000;
    input.frame = 1'000'000 + n;
    input.kind = 1;
    input.values = {0, 1, 0, 0};
    port.inputs.push_back(from_server(input));
  }
  poll();
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(core->timeline()->applied(), 6U);
  expect_agreed();
}

TEST_F(HostileTest, ADeltaThatPromisesAnImpossibleInputBringsARejoin) {
  join();
  auto delta = server.advance();
  delta.last_input = ~std::uint64_t{0};
  deliver(delta);
  for (int i = 0; i < 10; ++i) poll(40 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  recover();
}

TEST_F(HostileTest, StrangeClocksDoNoHarm) {
  join();
  const std::int64_t extremes[] = {std::numeric_limits<std::int64_t>::min(), -1, 0, 1,
                                   std::numeric_limits<std::int64_t>::max()};
  for (int i = 0; i < 50; ++i) {
    auto delta = server.advance();
    delta.server_time_ns = extremes[i % 5];
    deliver(delta);
    transport::ReplyMessage reply;
    reply.client = kClient;
    reply.epoch = 1000;
    reply.client_clock_ns = extremes[(i + 1) % 5];
    reply.server_time_ns = extremes[(i + 2) % 5];
    port.replies.push_back(from_server(reply));
    poll(kFrameNs);
    const std::int64_t due = core->poll({now_ns, wall_ns()});
    EXPECT_GT(due, now_ns);
    EXPECT_LE(due, now_ns + 500 * kMs);
    Sample sample;
    core->start_sampling();
    EXPECT_TRUE(core->sample(sample, SampleMode::kExtrapolate, {now_ns, wall_ns()}));
  }
  EXPECT_EQ(core->timeline()->applied(), 51U);
  expect_agreed();
}

}  // namespace
}  // namespace tandem::client
