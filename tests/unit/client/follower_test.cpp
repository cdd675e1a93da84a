// One stream by itself: a follower returns a loss, and the caller decides what to do.
#include "sdk/client/following/follower.hpp"

#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

class FollowerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    follower.emplace(server.session.streams[0],
                     std::move(*ClientTimeline::create(server.session.streams[0].layout)),
                     server.session.frame_rate_hz, 0, 0);
    ASSERT_TRUE(follower->open(port, server.session, kClient).has_value());
    ASSERT_TRUE(follower->ask(0));
  }
  void load() {
    EXPECT_FALSE(follower->take(server.advance(), 0).loss);
    EXPECT_EQ(follower->take(server.snapshot(), 0), SnapshotAssembly::Outcome::kStored);
    const auto snapshot = follower->choose_snapshot(0);
    ASSERT_TRUE(snapshot.has_value());
    ASSERT_TRUE(follower->load(*snapshot, port, 0).has_value());
    ASSERT_FALSE(follower->joining());
  }

  FakeServer server;
  FakePort port;
  ScheduledInputs scheduled;
  std::optional<Follower> follower;
};

TEST_F(FollowerTest, AppliesADeltaThatStaysUntilItIsPopped) {
  load();
  EXPECT_TRUE(follower->take(server.advance(), 0).done);
  EXPECT_TRUE(follower->apply_front(scheduled, 0).done);
  EXPECT_EQ(follower->timeline().hash(), server.hashes.at(server.frame()));
  ASSERT_NE(follower->front(), nullptr);
  EXPECT_EQ(follower->front()->frame, server.frame());
  follower->pop();
  const Follower::Step nothing_there = follower->apply_front(scheduled, 0);
  EXPECT_FALSE(nothing_there.done);
  EXPECT_FALSE(nothing_there.loss);
}

TEST_F(FollowerTest, AGapIsReturnedAndTheStateGoesOnUntilTheCallerJoinsAgain) {
  load();
  const Frame before = server.frame();
  server.advance();
  const Follower::Step taken = follower->take(server.advance(), 0);
  ASSERT_TRUE(taken.loss);
  EXPECT_EQ(taken.loss->reason, ResyncReason::kGap);
  EXPECT_FALSE(follower->joining());
  EXPECT_EQ(follower->timeline().hash(), server.hashes.at(before));
  const std::uint32_t attempt = follower->join_attempt();
  follower->join_again(kMs);
  EXPECT_TRUE(follower->joining());
  EXPECT_EQ(follower->timeline().hash(), server.hashes.at(before))
      << "to be drawn until a snapshot is loaded";
  EXPECT_TRUE(follower->ask(200 * kMs));
  EXPECT_EQ(follower->join_attempt(), attempt + 1);
}

TEST_F(FollowerTest, ADeltaWithAWrongHashIsReturnedAndThoseBehindItAreKept) {
  load();
  auto wrong = server.advance();
  ++wrong.hash;
  EXPECT_TRUE(follower->take(std::move(wrong), 0).done);
  EXPECT_TRUE(follower->take(server.advance(), 0).done);
  const Follower::Step applied = follower->apply_front(scheduled, 0);
  EXPECT_FALSE(applied.done);
  ASSERT_TRUE(applied.loss);
  EXPECT_EQ(applied.loss->reason, ResyncReason::kMismatch);
  ASSERT_NE(follower->front(), nullptr);
  EXPECT_EQ(follower->front()->frame, server.frame());
}

TEST_F(FollowerTest, APromisedInputIsWaitedForAndThenLost) {
  load();
  static_cast<void>(server.schedule(-30));
  EXPECT_TRUE(follower->take(server.advance(), 0).done);
  EXPECT_FALSE(follower->apply_front(scheduled, 0).loss);
  EXPECT_TRUE(follower->misses_input());
  EXPECT_FALSE(follower->apply_front(scheduled, Follower::kInputPatienceNs - 1).loss);
  const Follower::Step late = follower->apply_front(scheduled, 1);
  ASSERT_TRUE(late.loss);
  EXPECT_EQ(late.loss->reason, ResyncReason::kMissingInput);
}

TEST_F(FollowerTest, PartsAreToldSoonAndTheQuestionLessAndLessOften) {
  transport::AckMessage ack;
  for (const std::int64_t next_ms : {50, 100, 200, 250, 250}) {
    EXPECT_EQ(follower->repeat_ns(), next_ms * kMs);
    follower->tell_progress(ack);
  }
  server.advance();
  const auto parts = split(server.snapshot(), 3);
  EXPECT_EQ(follower->take(transport::SnapshotMessage(parts[1]), 7 * kMs),
            SnapshotAssembly::Outcome::kStored);
  EXPECT_EQ(follower->heard_ns(), 7 * kMs);
  EXPECT_EQ(follower->repeat_ns(), Follower::kPartAckNs);
  follower->tell_progress(ack);
  EXPECT_EQ(ack.snapshot_frame, server.frame());
  EXPECT_EQ(ack.snapshot_parts, 3U);
  EXPECT_EQ(ack.missing, (std::vector<std::uint32_t>{0, 1, 2, 1}));
  EXPECT_EQ(follower->repeat_ns(), Follower::kMaxRepeatNs);
}

TEST_F(FollowerTest, ASnapshotThatCannotBeLoadedIsAskedForAgain) {
  EXPECT_FALSE(follower->take(server.advance(), 0).loss);
  auto broken = server.snapshot();
  ++broken.frame;  // it says otherwise itself
  static_cast<void>(follower->take(std::move(broken), 0));
  const auto snapshot = follower->choose_snapshot(0);
  ASSERT_TRUE(snapshot.has_value());
  EXPECT_FALSE(follower->load(*snapshot, port, 0).has_value());
  EXPECT_TRUE(follower->joining());
  EXPECT_TRUE(follower->ask(250 * kMs));
}

}  // namespace
}  // namespace tandem::client
