#include "services/gateway/gateway.hpp"

#include "fake_world.hpp"

namespace tandem::gateway {
namespace {

using transport::AbsentMessage;
using transport::DeltaMessage;
using transport::Phase;
using transport::ReplyMessage;
using transport::ScheduledInputMessage;
using transport::SessionMessage;
using transport::SnapshotMessage;

std::vector<Frame> frames(const std::vector<DeltaMessage>& deltas) {
  std::vector<Frame> out;
  for (const DeltaMessage& delta : deltas) out.push_back(delta.frame);
  return out;
}

transport::ScheduledInputMessage scheduled(std::uint64_t number, Frame frame) {
  transport::ScheduledInputMessage input;
  input.epoch = kEpoch;
  input.number = number;
  input.frame = frame;
  return input;
}

TEST_F(GatewayTest, SaysThatThereIsNoSessionAndThenWhichOne) {
  const ViewerId id = *gateway.admit();
  EXPECT_EQ(only<AbsentMessage>(read(id)).size(), 1U);
  EXPECT_TRUE(read(id).empty());
  EXPECT_FALSE(gateway.server_alive());
  gateway.on_session(fake_session());
  const auto told = only<SessionMessage>(read(id));
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].epoch, kEpoch);
  EXPECT_TRUE(gateway.server_alive());
  gateway.on_server_alive(false);
  EXPECT_FALSE(gateway.server_alive());
  EXPECT_EQ(only<AbsentMessage>(read(id)).size(), 1U);
  gateway.on_server_alive(true);
  EXPECT_EQ(only<SessionMessage>(read(id)).size(), 1U);
  gateway.on_server_alive(true);
  EXPECT_TRUE(read(id).empty());
}

TEST_F(GatewayTest, OtherNamesAreToldAndViewersGoOn) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = join(7);
  SessionMessage renamed = fake_session();
  renamed.names = {{3, 0, "crane"}};
  gateway.on_names(renamed);
  const auto told = only<SessionMessage>(read(id));
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].epoch, kEpoch);
  EXPECT_EQ(told[0].names, (std::vector<transport::BodyName>{{3, 0, "crane"}}));
  const int cuts = world.cuts;
  frame();
  EXPECT_EQ(only<DeltaMessage>(read(id)).size(), 1U);
  EXPECT_EQ(world.cuts, cuts);
}

TEST_F(GatewayTest, AJoinerGetsASnapshotAndEveryDeltaAfterIt) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = *gateway.admit();
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
  frame();
  EXPECT_EQ(only<DeltaMessage>(read(id)).size(), 0U) << "of no use before the cut";
  later(accounts::kGatewayTransfers.collect_ns);
  EXPECT_EQ(world.cuts, 1);
  frame();
  frame();
  const auto got = read(id);
  ASSERT_FALSE(only<SnapshotMessage>(got).empty());
  EXPECT_EQ(only<SnapshotMessage>(got)[0].frame, 2U);
  EXPECT_EQ(frames(only<DeltaMessage>(got)), (std::vector<Frame>{3, 4}));
}

TEST_F(GatewayTest, ThoseWhoJoinTogetherShareOneSnapshotAndEveryMessage) {
  gateway.on_session(fake_session());
  frame();
  world.snapshot.resize(100);
  const ViewerId a = *gateway.admit(), b = *gateway.admit();
  EXPECT_FALSE(say(a, ack(1, Phase::kJoining)));
  later(accounts::kGatewayTransfers.collect_ns / 2);
  EXPECT_FALSE(say(b, ack(2, Phase::kJoining)));
  later(accounts::kGatewayTransfers.collect_ns / 2);
  EXPECT_EQ(world.cuts, 1);
  frame();
  std::vector<OutgoingPtr> of_a, of_b;
  for (auto next = gateway.next(a, now_ns); next.message; next = gateway.next(a, now_ns))
    of_a.push_back(next.message);
  for (auto next = gateway.next(b, now_ns); next.message; next = gateway.next(b, now_ns))
    of_b.push_back(next.message);
  ASSERT_EQ(of_a.size(), 4U) << "session, reply, snapshot, delta";
  ASSERT_EQ(of_b.size(), 4U);
  for (const std::size_t shared : {0U, 2U, 3U}) EXPECT_EQ(of_a[shared], of_b[shared]);
}

TEST_F(GatewayTest, ScheduledInputsThatTheSnapshotLacksGoBeforeIt) {
  gateway.on_session(fake_session());
  gateway.on_scheduled(scheduled(1, 2), now_ns);
  world.last_input = 1;
  frame();
  gateway.on_scheduled(scheduled(2, 4), now_ns);
  gateway.on_scheduled(scheduled(3, 5), now_ns);
  const ViewerId id = *gateway.admit();
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
  later(accounts::kGatewayTransfers.collect_ns);
  const auto got = read(id);
  const auto inputs = only<ScheduledInputMessage>(got);
  ASSERT_EQ(inputs.size(), 2U);
  EXPECT_EQ(inputs[0].number, 2U);
  EXPECT_EQ(inputs[1].number, 3U);
}

// Applies the frames that one message told, all without a payload.
void apply_quiet(Gateway& gateway, FakeWorld& world, std::uint32_t frames, std::int64_t now_ns) {
  for (std::uint32_t more = frames; more-- > 0;) {
    client::CompleteDelta delta;
    delta.frame = ++world.frame;
    delta.hash = 5;
    delta.more = more;
    gateway.on_applied(delta, now_ns);
  }
}

TEST_F(GatewayTest, QuietFramesAreOneMessageForViewersToo) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = join(7);
  const Frame before = world.frame;
  apply_quiet(gateway, world, 60, now_ns);
  frame();
  const auto got = only<DeltaMessage>(read(id));
  ASSERT_EQ(got.size(), 2U);
  EXPECT_EQ(got[0].frame, before + 60);
  EXPECT_EQ(got[0].earlier, 59U);
  EXPECT_EQ(got[0].hash, 5U);
  EXPECT_EQ(got[1].earlier, 0U);
}

TEST_F(GatewayTest, FramesThatCameTogetherStayTogether) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = join(7);
  for (std::uint32_t more = 3; more-- > 0;) {
    client::CompleteDelta delta;
    delta.frame = ++world.frame;
    delta.hash = world.frame;
    delta.server_time_ns = 100 - static_cast<std::int64_t>(more);
    delta.payload = transport::Bytes(5);
    delta.more = more;
    gateway.on_applied(delta, now_ns);
  }
  const auto got = only<DeltaMessage>(read(id));
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].frame, world.frame);
  EXPECT_EQ(got[0].server_time_ns, 100);
  const auto runs = transport::read_frames(got[0]);
  ASSERT_EQ(runs.size(), 3U);
  for (const transport::FrameRun& run : runs) EXPECT_EQ(run.hash, run.last);
}

TEST_F(GatewayTest, WhereItJoinsAgainAmidQuietFramesOnlyThoseAfterwardsAreTold) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = join(7);
  client::CompleteDelta lost;
  lost.frame = ++world.frame;
  lost.more = 9;
  gateway.on_applied(lost, now_ns);
  world.frame += 20;
  apply_quiet(gateway, world, 3, now_ns);
  const auto got = only<DeltaMessage>(read(id));
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].earlier, 2U);
}

TEST_F(GatewayTest, ADeltaIsOneMessageAndScheduledInputsAreUnchanged) {
  gateway.on_session(fake_session());
  const ViewerId id = join(7);
  ScheduledInputMessage input = scheduled(1, 4);
  input.source_client = 99;
  input.source_number = 3;
  input.values = {1, 2, 3, 4};
  gateway.on_scheduled(input, now_ns);
  frame(100'000);
  const auto got = read(id);
  EXPECT_EQ(only<ScheduledInputMessage>(got), std::vector{input});
  ASSERT_EQ(only<DeltaMessage>(got).size(), 1U);
  EXPECT_EQ(only<DeltaMessage>(got)[0].parts, 1U);
  EXPECT_EQ(only<DeltaMessage>(got)[0].payload.size(), 100'000U);
}

TEST_F(GatewayTest, AQuestionIsAnsweredOnceAndAgainOnlyWhenAskedAgain) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = join(7);
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
    later(250 * kMillisecond);
  }
  EXPECT_EQ(world.cuts, 1);
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining, 2)));
  later(accounts::kGatewayTransfers.collect_ns);
  EXPECT_EQ(world.cuts, 2);
}

TEST_F(GatewayTest, WhoAsksAllTheTimeIsNotAnsweredAllTheTime) {
  gateway.on_session(fake_session());
  frame();
  world.snapshot.resize(100);
  const ViewerId id = join(7);
  for (std::uint32_t attempt = 2; attempt < 100; ++attempt) {
    EXPECT_FALSE(say(id, ack(7, Phase::kJoining, attempt)));
    later(300 * kMillisecond);
    read(id);
  }
  EXPECT_LE(world.cuts, 1 + 4 + 15) << "4, and one in 2 s";
}

TEST_F(GatewayTest, ASnapshotThatIsNotPossibleYetIsMadeWhenItIs) {
  gateway.on_session(fake_session());
  world.plays = false;
  const ViewerId id = *gateway.admit();
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
  later(kSecond);
  EXPECT_EQ(world.cuts, 0);
  world.plays = true;
  frame();
  EXPECT_EQ(world.cuts, 1);
}

TEST_F(GatewayTest, ANewEpochStartsOver) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = join(7);
  frame();
  gateway.on_session(fake_session(kEpoch + 1));
  const auto got = read(id);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(only<SessionMessage>(got)[0].epoch, kEpoch + 1);
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining))) << "of the old epoch, under way";
  EXPECT_EQ(gateway.counts().stale, 1U);
  later(kSecond);
  EXPECT_EQ(world.cuts, 1);
}

TEST_F(GatewayTest, AnotherStreamOfTheEpochLosesNoInput) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = *gateway.admit();
  plays(id, 7);
  frame();
  EXPECT_FALSE(say(id, input(7, 1)));
  gateway.on_session(fake_session());
  later(kSecond);
  EXPECT_EQ(world.sent.size(), 1U);
}

TEST_F(GatewayTest, RepliesTellRolePhaseAndClock) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = *gateway.admit();
  read(id);
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
  const ReplyMessage first = reply(id);
  EXPECT_EQ(first.client, 7U);
  EXPECT_EQ(first.epoch, kEpoch);
  EXPECT_EQ(first.role, transport::Role::kParticipant);
  EXPECT_EQ(first.phase, Phase::kJoining);
  EXPECT_EQ(first.client_clock_ns, 5);
  EXPECT_EQ(first.server_time_ns, now_ns + kSecond) << "the server's clock, not the gateway's";
  EXPECT_TRUE(only<ReplyMessage>(read(id)).empty());
  plays(id, 7);
  EXPECT_EQ(reply(id).phase, Phase::kPlaying);
}

TEST_F(GatewayTest, AGatewayThatIsAnObserverSaysSo) {
  gateway.on_session(fake_session());
  frame();
  const ViewerId id = join(7);
  world.granted = transport::Role::kObserver;
  later(0);
  const ReplyMessage told = reply(id);
  EXPECT_EQ(told.role, transport::Role::kObserver);
  EXPECT_EQ(told.reason, static_cast<std::uint32_t>(transport::Reason::kDemoted));
}

TEST_F(GatewayTest, StatusIsTheNewestOnly) {
  gateway.on_session(fake_session());
  const ViewerId id = *gateway.admit();
  read(id);
  transport::ServerStatusMessage status;
  status.session = "default";
  status.codec = status.predictor = "x";
  status.epoch = kEpoch;
  for (Frame f = 1; f <= 3; ++f) {
    status.frame = f;
    gateway.on_status(status, now_ns);
  }
  status.epoch = 1;
  gateway.on_status(status, now_ns);
  const auto told = only<transport::ServerStatusMessage>(read(id));
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].frame, 3U);
}

// A second message to everybody would delay the frame behind it by as long as a frame takes.
TEST_F(GatewayTest, AStatusReachesAFewViewersAtATimeAndAllWithinHalfASecond) {
  gateway.on_session(fake_session());
  const std::vector<ViewerId> ids{*gateway.admit(), *gateway.admit(), *gateway.admit()};
  transport::ServerStatusMessage status;
  status.session = "default";
  status.codec = status.predictor = "x";
  status.epoch = kEpoch;
  gateway.on_status(status, now_ns);
  for (const ViewerId id : ids)
    EXPECT_EQ(only<transport::ServerStatusMessage>(read(id)).size(), 1U) << "the first one is told at once";
  status.frame = 1;
  gateway.on_status(status, now_ns);
  std::vector<ViewerId> told;
  std::size_t most_at_once = 0;
  const std::int64_t end_ns = now_ns + kSecond / 2;
  for (; now_ns < end_ns; now_ns += 33 * kMillisecond) {
    std::size_t at_once = 0;
    for (const ViewerId id : ids) {
      if (only<transport::ServerStatusMessage>(read(id)).empty()) continue;
      told.push_back(id);
      ++at_once;
    }
    most_at_once = std::max(most_at_once, at_once);
  }
  EXPECT_EQ(told, ids);
  EXPECT_EQ(most_at_once, 1U);
}

class SlowViewerTest : public GatewayTest {
 protected:
  SlowViewerTest() : GatewayTest({.viewers = 3, .queue_bytes = 100'000}) {
    gateway.on_session(fake_session());
    frame();
  }
};

TEST_F(SlowViewerTest, OneThatFallsBehindGoesOnWithTheNewestAndJoinsAgain) {
  const ViewerId id = join(7);
  for (int i = 0; i < 200; ++i) frame(1000);
  EXPECT_EQ(frames(only<DeltaMessage>(read(id))), std::vector<Frame>{world.frame});
  EXPECT_EQ(gateway.counts().skips, 1U);
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining, 2)));
  later(accounts::kGatewayTransfers.collect_ns);
  frame(1000);
  const auto got = read(id);
  EXPECT_EQ(only<SnapshotMessage>(got)[0].frame, world.frame - 1);
  EXPECT_EQ(frames(only<DeltaMessage>(got)), std::vector<Frame>{world.frame});
}

TEST_F(SlowViewerTest, WhatWeighsMoreThanASnapshotIsSkippedAfterASecond) {
  const ViewerId id = join(7);
  for (int i = 0; i < 20; ++i) frame(1000);
  EXPECT_EQ(only<DeltaMessage>(read(id)).size(), 20U) << "0.7 s";
  for (int i = 0; i < 40; ++i) frame(1000);
  EXPECT_EQ(only<DeltaMessage>(read(id)).size(), 1U) << "1.3 s";
  for (int i = 0; i < 40; ++i) frame(10);
  EXPECT_EQ(only<DeltaMessage>(read(id)).size(), 40U) << "less than a snapshot";
}

TEST_F(SlowViewerTest, OneThatFallsBehindWhileItJoinsGetsAFreshSnapshot) {
  const ViewerId id = *gateway.admit();
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
  later(accounts::kGatewayTransfers.collect_ns);
  read(id);  // as many parts as may be on their way
  for (int i = 0; i < 200; ++i) frame(1000);
  EXPECT_TRUE(only<DeltaMessage>(read(id)).empty());
  later(accounts::kSnapshotSpacingNs);
  later(accounts::kSnapshotSpacingNs);
  EXPECT_EQ(world.cuts, 2);
  const auto parts = only<SnapshotMessage>(read(id));
  ASSERT_FALSE(parts.empty());
  EXPECT_EQ(parts[0].frame, world.frame);
}

TEST_F(SlowViewerTest, OneThatNeverReadsChangesNothingAndIsLetGo) {
  const ViewerId reads = join(1), sleeps = join(2);
  std::vector<ViewerId> ids;
  for (int i = 0; i < 20 * 30; ++i) {
    frame(1000);
    gateway.list_ready(now_ns, ids);
    EXPECT_EQ(only<DeltaMessage>(read(reads)).size(), 1U);
    if (i % 8 == 0) plays(reads, 1);
  }
  gateway.list_not_reading(now_ns, ids);
  EXPECT_TRUE(ids.empty());
  now_ns += 11 * kSecond;
  gateway.list_not_reading(now_ns, ids);
  EXPECT_EQ(ids, std::vector{sleeps});
}

TEST_F(SlowViewerTest, OneWithNothingToReadIsNotLetGo) {
  join(1);
  std::vector<ViewerId> ids;
  gateway.list_ready(now_ns, ids);
  now_ns += 100 * kSecond;
  gateway.list_not_reading(now_ns, ids);
  EXPECT_TRUE(ids.empty());
}

TEST_F(SlowViewerTest, TooManyAreRefusedUntilOneLeaves) {
  EXPECT_TRUE(gateway.admit());
  EXPECT_TRUE(gateway.admit());
  const ViewerId last = *gateway.admit();
  EXPECT_FALSE(gateway.admit());
  gateway.leave(last);
  EXPECT_TRUE(gateway.admit());
}

TEST_F(GatewayTest, AViewerThatAcknowledgesNothingIsListedAfterTenSeconds) {
  const ViewerId id = *gateway.admit();
  std::vector<ViewerId> silent;
  const auto listed = [&] {
    gateway.list_silent(now_ns, silent);
    return !silent.empty();
  };
  read(id);
  EXPECT_FALSE(listed());
  now_ns += 60 * kSecond;
  EXPECT_FALSE(listed()) << "there is no session";
  gateway.on_session(fake_session());
  read(id);
  EXPECT_FALSE(listed());
  now_ns += 9 * kSecond;
  EXPECT_FALSE(listed());
  EXPECT_FALSE(say(id, ack(7, Phase::kJoining)));
  EXPECT_FALSE(listed());
  now_ns += 10 * kSecond;
  EXPECT_FALSE(listed());
  now_ns += 1;
  EXPECT_TRUE(listed());
}

}  // namespace
}  // namespace tandem::gateway
