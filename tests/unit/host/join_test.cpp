// How clients get in and what they are told.
#include <gtest/gtest.h>

#include "sdk/core/timeline/timeline.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using transport::Phase;
using transport::Reason;
using transport::Role;

class JoinTest : public ::testing::Test {
 protected:
  JoinTest() {
    bench.poll();
    bench.run_to(10);
  }
  Bench bench;
};

TEST_F(JoinTest, ASnapshotIsMadeOnDemandOnly) {
  bench.run_ms(2000);
  EXPECT_TRUE(bench.port.snapshots.empty());
  bench.joining(1);
  bench.run_ms(150);
  ASSERT_EQ(bench.port.snapshots.size(), 1U);
  EXPECT_EQ(bench.port.snapshots[0].epoch, bench.host->session().epoch);
  EXPECT_EQ(bench.port.snapshots[0].total_bytes, bench.port.snapshots[0].bytes.size());
  EXPECT_LE(bench.port.snapshots[0].total_bytes, bench.host->session().streams[0].max_snapshot_bytes);
}

TEST_F(JoinTest, TheSnapshotWaitsUntilAllThreeWritersMatchedThatParticipant) {
  bench.port.unmatched.insert(participant(1));
  bench.joining(1);
  bench.run_ms(3000);
  EXPECT_TRUE(bench.port.snapshots.empty());
  bench.port.unmatched.clear();
  bench.run_ms(150);
  EXPECT_EQ(bench.port.snapshots.size(), 1U);
}

TEST_F(JoinTest, JoinersAreCollectedForAMomentAndShareOneSnapshot) {
  bench.joining(1);
  bench.run_ms(5);
  bench.joining(2);
  bench.joining(3);
  bench.run_ms(4);
  EXPECT_TRUE(bench.port.snapshots.empty());
  bench.run_ms(3 + 33);  // and the next frame
  EXPECT_EQ(bench.port.snapshots_to, (std::vector<transport::ClientId>{1, 2, 3}));
  EXPECT_EQ(bench.host->totals().snapshots, 1U) << "all three are served";
}

TEST_F(JoinTest, AClientThatOnlyLooksForTheSessionHasItsWritersAndNoSnapshot) {
  auto looking = bench.ack(1, Phase::kJoining, 0);
  looking.epoch = 0;
  bench.send(looking);
  bench.run_ms(500);
  EXPECT_TRUE(bench.port.client_writers.contains(1));
  EXPECT_TRUE(bench.port.snapshots.empty());
  EXPECT_EQ(bench.host->totals().refused_messages, 0U);
  bench.joining(1);
  bench.run_ms(100);
  EXPECT_EQ(bench.host->totals().snapshots, 1U);
  bench.send(looking);
  bench.run_ms(10);
  bench.playing(1, bench.host->frame());
  bench.poll();
  bench.send(looking);
  bench.poll();
  EXPECT_EQ(bench.host->participants(), 1U) << "heard late, it changes nothing";
}

TEST_F(JoinTest, TheSnapshotIsCutRightAfterADeltaAndLeavesBehindIt) {
  bench.joining(1);
  bench.run_ms(150);
  const auto snapshot = std::ranges::find(bench.port.order, "snapshot");
  const auto deltas_before = std::count(bench.port.order.begin(), snapshot, "delta");
  EXPECT_EQ(bench.port.snapshots[0].frame, static_cast<Frame>(deltas_before));
}

TEST_F(JoinTest, TheFrameThatASnapshotIsCutAfterIsRoundedForItAndNoOther) {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "tracker";
  Bench rounding(config);
  rounding.poll();
  rounding.run_to(10);
  rounding.joining(1);
  for (int ms = 0; ms < 150; ++ms) {
    rounding.run_ms(1);
    EXPECT_GT(rounding.host->next_wake_ns(), rounding.now) << "waiting for the frame takes no time";
  }
  ASSERT_EQ(rounding.port.snapshots.size(), 1U);
  for (const auto& delta : rounding.port.deltas) {
    const bool rounds = !delta.payload.empty() && delta.payload[0] == std::byte{0x87};
    EXPECT_EQ(rounds, delta.frame == rounding.port.snapshots[0].frame) << delta.frame;
  }
}

TEST_F(JoinTest, AClientTimelineStartsFromTheSnapshotAndFollows) {
  bench.simulation.on_step = [this](std::uint64_t step) {
    for (auto& column : bench.simulation.position) column[1] += 0.1F * static_cast<float>(step % 7);
  };
  bench.enter(2);
  bench.on_ms = [this] { bench.playing(2, bench.host->frame()); };
  bench.run_ms(100);
  bench.joining(1);
  bench.run_ms(90);
  bench.send(bench.gravity(2, 1));  // pending when the snapshot is cut, or acting around it
  bench.run_ms(300);
  const auto& session = bench.host->session();
  auto client = ClientTimeline::create(session.streams[0].layout);
  ASSERT_TRUE(client);
  const auto& snapshot = bench.port.snapshots.back();
  ASSERT_TRUE(client->load(snapshot.bytes, session.epoch));
  EXPECT_EQ(client->applied(), snapshot.frame);
  for (const auto& input : bench.port.scheduled) {
    const ScheduledDrive drive{
        input.number,
        input.frame,
        {{input.values[0], input.values[1], input.values[2]}, static_cast<std::uint16_t>(input.values[3])}};
    ASSERT_TRUE(client->schedule(drive));
  }
  for (const auto& delta : bench.port.deltas) {
    if (delta.frame <= snapshot.frame) continue;
    const auto applied = client->apply(delta.frame, delta.last_input, delta.hash, delta.payload);
    ASSERT_TRUE(applied) << applied.error().message;
  }
  EXPECT_EQ(client->applied(), bench.host->frame());
  EXPECT_EQ(client->hash(), bench.host->hash());
  EXPECT_EQ(client->drive().gravity[2],
            to_drive(test_config().streams[0].lattice, {0, 0, -5}, 0)->gravity[2]);
}

TEST_F(JoinTest, TheSameJoinerGetsAnotherOnlyAfterItAsksAgainAndTheFirstStalled) {
  bench.joining(1, 1);
  bench.run_ms(150);
  for (int i = 0; i < 50; ++i) {
    bench.joining(1, 1);
    bench.run_ms(100);
  }
  EXPECT_EQ(bench.host->totals().snapshots, 1U);
  EXPECT_GT(bench.port.snapshots.size(), 1U) << "its parts again, as nobody says that they arrived";
  bench.joining(1, 2);
  bench.run_ms(150);
  EXPECT_EQ(bench.host->totals().snapshots, 2U);
  bench.joining(1, 3);
  bench.run_ms(2500);
  EXPECT_EQ(bench.host->totals().snapshots, 2U) << "still on its way";
  bench.run_ms(1000);
  EXPECT_EQ(bench.host->totals().snapshots, 3U);
}

TEST_F(JoinTest, WhoAsksInALoopIsServedEveryTwoSecondsWhateverItsIds) {
  std::uint32_t attempt = 0;
  bench.on_ms = [&] {
    ++attempt;
    for (transport::ClientId id = 1; id <= 16; ++id) {
      bench.port.acks.push_back(
          {bench.ack(id, Phase::kJoining, 0, Role::kObserver, attempt), participant(1)});
    }
  };
  bench.run_ms(20'000);
  const std::uint64_t served = bench.host->totals().snapshots;
  EXPECT_LE(served, 1 + 4 + 10U);
  bench.on_ms = {};
  bench.joining(21);
  bench.run_ms(3'200);
  EXPECT_GT(bench.host->totals().snapshots, served)
      << "others wait for what receives nothing no longer than 3 s";
}

TEST_F(JoinTest, OneThatIsBeingSentASnapshotOrNeverAnswersKeepsNobodyWaiting) {
  bench.joining(1);
  bench.run_ms(150);
  ASSERT_EQ(bench.host->totals().snapshots, 1U);
  bench.on_ms = [&] { bench.joining(1); };
  bench.joining(2);
  bench.run_ms(300);
  EXPECT_EQ(bench.host->totals().snapshots, 2U);
  EXPECT_TRUE(std::ranges::count(bench.port.snapshots_to, transport::ClientId{2}) > 0);
}

TEST_F(JoinTest, AJoinerIsServedWhileTheServerIsSuspended) {
  bench.enter(2);
  bench.run_ms(600);  // suspended: client 2 is silent
  const Frame held = bench.host->frame();
  bench.joining(1);
  bench.run_ms(110);
  ASSERT_FALSE(bench.port.snapshots.empty());
  EXPECT_EQ(bench.port.snapshots.back().frame, held);
}

TEST_F(JoinTest, ARoleAndPhaseAreConfirmedByReplies) {
  bench.joining(1);
  bench.run_ms(20);
  ASSERT_NE(bench.last_reply(1), nullptr);
  EXPECT_EQ(bench.last_reply(1)->role, Role::kParticipant);
  EXPECT_EQ(bench.last_reply(1)->phase, Phase::kJoining);
  bench.playing(1, bench.host->frame(), Role::kObserver);
  bench.run_ms(20);
  EXPECT_EQ(bench.last_reply(1)->role, Role::kObserver);
  EXPECT_EQ(bench.last_reply(1)->phase, Phase::kPlaying);
}

TEST_F(JoinTest, WhoCannotSendInputsIsAnObserverWhateverItWants) {
  bench.port.mute.insert(participant(1));
  bench.enter(1);
  bench.run_ms(20);
  ASSERT_NE(bench.last_reply(1), nullptr);
  EXPECT_EQ(bench.last_reply(1)->role, Role::kObserver);
  const Frame before = bench.host->frame();
  bench.run_ms(600);  // silent
  EXPECT_GT(bench.host->frame(), before + 10) << "nobody waits for it";
  bench.port.mute.clear();
  bench.playing(1, bench.host->frame());
  bench.run_ms(20);
  EXPECT_EQ(bench.last_reply(1)->role, Role::kParticipant) << "its writer was found later";
}

TEST_F(JoinTest, WhoComesFirstUnderAnIdKeepsItsOwnerOutUntilItIsGone) {
  bench.port.acks.push_back({bench.ack(1, Phase::kJoining, 0), participant(9)});
  bench.run_ms(20);
  const std::uint64_t refused = bench.host->totals().refused_messages;
  const std::size_t replies = bench.port.replies.size();
  bench.joining(1);
  bench.run_ms(20);
  EXPECT_EQ(bench.host->totals().refused_messages, refused + 1);
  EXPECT_EQ(bench.port.replies.size(), replies) << "the reply would reach the other";
  bench.port.dead.insert(participant(9));
  bench.port.gone.insert(participant(9));
  bench.run_ms(2000);
  bench.joining(1, 2);
  bench.run_ms(20);
  EXPECT_EQ(bench.host->totals().refused_messages, refused + 1);
  EXPECT_GT(bench.port.replies.size(), replies);
}

TEST_F(JoinTest, WithoutAChangeARoundOfRepliesGoesOutOnceASecondAndEchoesTheClock) {
  bench.enter(1);
  bench.on_ms = [this] { bench.playing(1, bench.host->frame()); };
  bench.run_ms(100);
  const std::size_t before = bench.port.replies.size();
  bench.run_ms(10'000);
  EXPECT_NEAR(static_cast<double>(bench.port.replies.size() - before), 10, 1);
  const auto& reply = bench.port.replies.back();
  EXPECT_LT(bench.now - reply.client_clock_ns, kSecond);
  EXPECT_EQ(reply.server_time_ns - Bench::kWallStart, reply.client_clock_ns)
      << "answered in the poll it came";
}

TEST_F(JoinTest, AnAccountHasAReplyWriterOfItsOwnUntilItIsForgotten) {
  bench.joining(1);
  bench.run_ms(20);
  EXPECT_TRUE(bench.port.client_writers.contains(1));
  const auto stranger = bench.ack(2, Phase::kJoining, 0);
  auto other_version = stranger;
  other_version.protocol_version += 1;
  bench.send(other_version);
  bench.run_ms(20);
  ASSERT_NE(bench.last_reply(2), nullptr);
  EXPECT_FALSE(bench.port.client_writers.contains(2)) << "no account";
  bench.port.dead.insert(participant(1));
  bench.run_ms(59'000);
  EXPECT_TRUE(bench.port.client_writers.contains(1));
  bench.run_ms(2'000);
  EXPECT_TRUE(bench.port.client_writers.empty());
  bench.port.dead.clear();
  bench.joining(1);
  bench.run_ms(20);
  EXPECT_TRUE(bench.port.client_writers.contains(1));
}

TEST_F(JoinTest, AnAccountIsForgottenAtOnceWhenNothingIsLeftOfItsParticipant) {
  bench.joining(1);
  bench.joining(2);
  bench.run_ms(20);
  bench.port.dead = {participant(1), participant(2)};
  bench.port.gone.insert(participant(2));
  bench.run_ms(500);
  EXPECT_TRUE(bench.port.client_writers.contains(1)) << "silent: it may come back";
  EXPECT_FALSE(bench.port.client_writers.contains(2));
}

TEST_F(JoinTest, StrangersAreAnsweredTwentyTimesASecondAllTogether) {
  bench.on_ms = [this, next = transport::ClientId{1000}]() mutable {
    auto ack = bench.ack(next++, Phase::kJoining, 0);
    ack.protocol_version += 1;
    bench.send(ack);
  };
  bench.run_ms(5'000);
  EXPECT_GE(bench.port.replies.size(), 100U);
  EXPECT_LE(bench.port.replies.size(), 120U);
}

TEST_F(JoinTest, ASilentClientIsSentNoReplies) {
  bench.enter(1, Role::kObserver);
  bench.run_ms(100);
  const std::size_t before = bench.port.replies.size();
  bench.run_ms(10'000);
  EXPECT_EQ(bench.port.replies.size(), before);
}

TEST_F(JoinTest, AWrongProtocolVersionIsAnsweredWithItsReasonAndIgnored) {
  auto ack = bench.ack(1, Phase::kPlaying, 0);
  ack.protocol_version = transport::kProtocolVersion + 1;
  for (int i = 0; i < 100; ++i) {
    bench.send(ack);
    bench.run_ms(10);
  }
  ASSERT_NE(bench.last_reply(1), nullptr);
  EXPECT_EQ(bench.last_reply(1)->reason, static_cast<std::uint32_t>(Reason::kProtocolVersion));
  EXPECT_LE(bench.port.replies.size(), 3U) << "twice a second at most";
  EXPECT_EQ(bench.host->totals().clients_seen, 0U);
  EXPECT_EQ(bench.host->totals().refused_messages, 100U);
  EXPECT_GT(bench.host->frame(), 35U) << "and not waited for";
}

TEST_F(JoinTest, AnAcknowledgementOfAnotherEpochIsIgnored) {
  auto ack = bench.ack(1, Phase::kPlaying, 5);
  ack.epoch += 1;
  bench.send(ack);
  bench.run_ms(50);
  EXPECT_EQ(bench.host->totals().clients_seen, 0U);
  EXPECT_EQ(bench.host->totals().refused_messages, 1U);
}

TEST_F(JoinTest, UnreadableAcknowledgementsAreRefusedAndCounted) {
  auto phase = bench.ack(1, static_cast<Phase>(7), 0);
  auto role = bench.ack(1, Phase::kJoining, 0, static_cast<Role>(7));
  auto nobody = bench.ack(0, Phase::kJoining, 0);
  bench.send(phase);
  bench.send(role);
  bench.send(nobody);
  bench.run_ms(50);
  EXPECT_EQ(bench.host->totals().refused_messages, 3U);
  EXPECT_EQ(bench.host->totals().clients_seen, 0U);
}

TEST(ClientLimit, ClientsBeyondTheLimitAreToldAndSeatsOfTheDeadAreGivenAway) {
  HostConfig config = test_config();
  config.client_limit = 2;
  Bench bench(config);
  bench.poll();
  bench.joining(1);
  bench.joining(2);
  bench.joining(3);
  bench.run_ms(20);
  ASSERT_NE(bench.last_reply(3), nullptr);
  EXPECT_EQ(bench.last_reply(3)->reason, static_cast<std::uint32_t>(Reason::kFull));
  EXPECT_EQ(bench.host->totals().clients_seen, 2U);
  bench.port.dead.insert(participant(2));
  bench.run_ms(500);
  bench.joining(3);
  bench.run_ms(20);
  EXPECT_EQ(bench.host->totals().clients_seen, 3U);
  EXPECT_EQ(bench.last_reply(3)->reason, static_cast<std::uint32_t>(Reason::kNone));
}

TEST(ClientLimit, ALimitThatChangesHoldsForThoseThatCome) {
  HostConfig config = test_config();
  config.client_limit = 2;
  Bench bench(config);
  bench.poll();
  bench.joining(1);
  bench.joining(2);
  bench.run_ms(20);
  EXPECT_FALSE(bench.host->set_limits(0, {}));
  ASSERT_TRUE(bench.host->set_limits(1, {}));
  bench.joining(1);
  bench.joining(2);
  bench.joining(3);
  bench.run_ms(20);
  EXPECT_EQ(bench.last_reply(2)->reason, static_cast<std::uint32_t>(Reason::kNone)) << "nobody is sent away";
  EXPECT_EQ(bench.last_reply(3)->reason, static_cast<std::uint32_t>(Reason::kFull));
  ASSERT_TRUE(bench.host->set_limits(3, {}));
  bench.joining(3);
  bench.run_ms(20);
  EXPECT_EQ(bench.last_reply(3)->reason, static_cast<std::uint32_t>(Reason::kNone));
}

TEST(ClientLimit, OneParticipantHoldsSixteenClientsAtMost) {
  Bench bench;
  bench.poll();
  for (transport::ClientId id = 1; id <= 20; ++id) {
    bench.port.acks.push_back({bench.ack(id, Phase::kJoining, 0), participant(1)});
  }
  bench.run_ms(20);
  EXPECT_EQ(bench.host->totals().clients_seen, 16U);
  EXPECT_EQ(bench.last_reply(17)->reason, static_cast<std::uint32_t>(Reason::kFull));
  bench.joining(21);
  bench.run_ms(20);
  EXPECT_EQ(bench.host->totals().clients_seen, 17U) << "another participant's client finds a seat";
}

TEST(ClientLimit, ClientsOfAParticipantThatAreGoneHoldNoSeatOfIt) {
  Bench bench;
  bench.poll();
  const auto joins = [&](transport::ClientId id) {
    bench.port.acks.push_back({bench.ack(id, Phase::kJoining, 0), participant(1)});
  };
  for (transport::ClientId id = 1; id <= 16; ++id) joins(id);
  bench.run_ms(31'000);  // nothing more is heard of them
  for (transport::ClientId id = 21; id <= 36; ++id) joins(id);
  bench.run_ms(20);
  EXPECT_EQ(bench.host->totals().clients_seen, 32U);
}

}  // namespace
}  // namespace tandem::host
