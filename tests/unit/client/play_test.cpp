#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

using PlayTest = ClientTest;

TEST_F(PlayTest, EveryFrameIsAppliedAndAcknowledgedWithTheServersHash) {
  join();
  port.acks.clear();
  for (int i = 0; i < 200; ++i) frame();
  EXPECT_EQ(core->timeline()->applied(), 201U);
  EXPECT_EQ(figures().frames_applied, 200U);
  expect_agreed();
}

TEST_F(PlayTest, AQuarterOfTheWindowIsAcknowledgedAtOnce) {
  join();
  port.acks.clear();
  for (int i = 0; i < 60; ++i) frame();
  EXPECT_EQ(port.acks.size(), 10U) << "a ceiling of 24";
  EXPECT_EQ(port.acks.back().applied, 61U);
  frame();
  EXPECT_EQ(port.acks.size(), 10U);
  for (int i = 0; i < 25; ++i) poll(2 * kMs);
  ASSERT_EQ(port.acks.size(), 11U) << "no further delta: the server may be waiting";
  EXPECT_EQ(port.acks.back().applied, 62U);
}

TEST_F(PlayTest, EachFrameIsAcknowledgedWhereTheWindowIsSmall) {
  server.session.window_ceiling = 2;
  join();
  port.acks.clear();
  for (int i = 0; i < 20; ++i) frame();
  EXPECT_EQ(port.acks.size(), 20U);
}

class ObserverTest : public PlayTest {
 protected:
  void answer() {
    transport::ReplyMessage reply;
    reply.client = kClient;
    reply.epoch = server.session.epoch;
    port.replies.push_back(from_server(reply));
    poll(kMs);
  }
};

TEST_F(ObserverTest, AcknowledgesEveryTenSeconds) {
  start(1, transport::Role::kObserver);
  join();
  answer();
  port.acks.clear();
  port.statuses.clear();
  for (int i = 0; i < 900; ++i) frame();
  EXPECT_NEAR(static_cast<double>(port.acks.size()), 3, 1);
  EXPECT_NEAR(static_cast<double>(port.statuses.size()), 15, 1);
}

// So that a server that goes on with the session learns soon who plays which stream.
TEST_F(ObserverTest, WhoHearsNoFrameAcknowledgesEverySecond) {
  start(1, transport::Role::kObserver);
  join();
  answer();
  frame();
  port.acks.clear();
  for (int i = 0; i < 50; ++i) poll(100 * kMs);
  EXPECT_NEAR(static_cast<double>(port.acks.size()), 4, 1);
}

TEST_F(ObserverTest, WhoWasNotAnsweredAcknowledgesEverySecond) {
  start(1, transport::Role::kObserver);
  join();
  port.acks.clear();
  for (int i = 0; i < 150; ++i) frame();
  EXPECT_NEAR(static_cast<double>(port.acks.size()), 5, 1);
}

TEST_F(PlayTest, DeltasInPartsAreApplied) {
  join();
  for (int i = 0; i < 20; ++i) {
    for (auto& part : split(server.advance(), 3)) deliver(std::move(part));
    poll(kFrameNs);
  }
  EXPECT_EQ(core->timeline()->applied(), 21U);
  expect_agreed();
}

TEST_F(PlayTest, DeltasOfAnotherStreamOrGenerationAreIgnored) {
  join();
  const auto delta = server.advance();
  for (const StreamId other : {StreamId{1, 0}, StreamId{0, 1}}) {
    auto foreign = delta;
    foreign.stream = other;
    deliver(foreign);
  }
  poll();
  EXPECT_EQ(core->timeline()->applied(), 1U);
  EXPECT_EQ(figures().stale_messages, 2U);
  deliver(delta);
  poll();
  EXPECT_EQ(core->timeline()->applied(), 2U);
  expect_agreed();
}

TEST_F(PlayTest, ALostPartBringsARejoin) {
  join();
  auto parts = split(server.advance(), 3);
  deliver(parts[0]);
  deliver(parts[2]);
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(figures().resyncs_by_reason[static_cast<std::size_t>(ResyncReason::kLostPart)], 1U);
}

TEST_F(PlayTest, AGapBringsARejoinThatKeepsWhatFollows) {
  join();
  static_cast<void>(server.advance());
  deliver(server.advance());
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  poll(100 * kMs);
  EXPECT_EQ(port.acks.back().phase, transport::Phase::kJoining);
  EXPECT_EQ(port.acks.back().join_attempt, 2U);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(core->timeline()->applied(), 8U);
  EXPECT_EQ(figures().resyncs, 1U);
  expect_agreed();
}

TEST_F(PlayTest, AScheduledInputThatComesAfterItsDeltaIsWaitedFor) {
  join();
  const auto input = server.schedule(700);
  frame();
  EXPECT_EQ(core->timeline()->applied(), 1U);
  frame();
  EXPECT_EQ(core->timeline()->applied(), 1U);
  port.inputs.push_back(from_server(input));
  poll();
  EXPECT_EQ(core->timeline()->applied(), 3U);
  EXPECT_EQ(figures().resyncs, 0U);
  expect_agreed();
}

TEST_F(PlayTest, AScheduledInputStillMissingAfterAQuarterOfASecondBringsARejoin) {
  join();
  static_cast<void>(server.schedule(700));
  frame();
  for (int i = 0; i < 6; ++i) poll(40 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  poll(40 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(figures().resyncs_by_reason[static_cast<std::size_t>(ResyncReason::kMissingInput)], 1U);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll(40 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  for (int i = 0; i < 5; ++i) frame();
  expect_agreed();
}

TEST_F(PlayTest, APauseOfTheProcessIsNotHeldAgainstAMissingInput) {
  join();
  const auto input = server.schedule(700);
  frame();
  poll(5000 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  port.inputs.push_back(from_server(input));
  poll();
  EXPECT_EQ(core->timeline()->applied(), 2U);
}

TEST_F(PlayTest, AnInputActsOnItsFrame) {
  join();
  port.inputs.push_back(from_server(server.schedule(700)));  // frame 1 is out, acts on 3
  frame();
  EXPECT_EQ(core->timeline()->drive().gravity[1], -20);
  frame();
  EXPECT_EQ(core->timeline()->applied(), 3U);
  EXPECT_EQ(core->timeline()->drive().gravity[1], 700);
  expect_agreed();
}

TEST_F(PlayTest, ItSimulatesOneFrameAheadWhenTheServerDoesAndHaltsThere) {
  join();
  for (int i = 0; i < 20; ++i) frame();
  EXPECT_EQ(core->timeline()->now(), core->timeline()->applied());
  poll(kFrameNs);  // the next frame is due, its delta is late
  EXPECT_EQ(core->timeline()->now(), core->timeline()->applied() + 1);
  for (int i = 0; i < 10; ++i) poll(kFrameNs);
  EXPECT_EQ(core->timeline()->now(), core->timeline()->applied() + 1);
  EXPECT_EQ(port.acks.back().simulated, 22U);
  frame();
  EXPECT_EQ(core->timeline()->applied(), 22U);
  expect_agreed();
}

TEST_F(PlayTest, WithLeadZeroItNeverSimulatesAhead) {
  start(0);
  join();
  for (int i = 0; i < 20; ++i) frame();
  for (int i = 0; i < 10; ++i) poll(kFrameNs);
  EXPECT_EQ(core->timeline()->now(), core->timeline()->applied());
}

TEST_F(PlayTest, PollAsksToBeCalledWhenTheNextFrameIsDueToBeDrawn) {
  join();
  core->start_sampling();
  for (int i = 0; i < 40; ++i) frame();
  const std::int64_t due = core->poll({now_ns, wall_ns()});
  EXPECT_GT(due, now_ns);
  EXPECT_LE(due, now_ns + 50 * kMs);
  EXPECT_NEAR(static_cast<double>(due - now_ns), static_cast<double>(kFrameNs), 2e6);
}

TEST_F(PlayTest, WhereNobodyDrawsNoFrameIsDueBeforeItsDelta) {
  join();
  for (int i = 0; i < 40; ++i) frame();
  const std::int64_t due = core->poll({now_ns, wall_ns()});
  EXPECT_GT(due, now_ns + kFrameNs * 11 / 10) << "the next delta comes before that";
  poll(kFrameNs);
  EXPECT_EQ(core->timeline()->now(), core->timeline()->applied() + 1) << "simulated ahead all the same";
}

TEST_F(PlayTest, TheAcknowledgementIsRepeatedWhenNoFrameComes) {
  join();
  port.acks.clear();
  for (int i = 0; i < 80; ++i) poll(50 * kMs);
  EXPECT_GE(port.acks.size(), 3U);
  EXPECT_LE(port.acks.size(), 5U);
}

TEST_F(PlayTest, ToAServerThatShowsNoSignOfLifeItIsRepeatedSeldom) {
  join();
  poll(1000 * kMs);
  port.alive = false;
  port.acks.clear();
  for (int i = 0; i < 160; ++i) poll(50 * kMs);
  EXPECT_GE(port.acks.size(), 1U);
  EXPECT_LE(port.acks.size(), 3U);
}

TEST_F(PlayTest, WhileNothingComesItWakesTwiceASecondAtMostAndForItsStatus) {
  join();
  for (int i = 0; i < 40; ++i) frame();
  port.alive = false;
  poll(2000 * kMs);
  const std::int64_t began_ns = now_ns;
  int polls = 0;
  for (; now_ns < began_ns + 8000 * kMs; ++polls) poll(core->poll({now_ns, wall_ns()}) - now_ns);
  EXPECT_LE(polls, 8 * 3 + 2);
}

TEST_F(PlayTest, LatencyIsMeasuredFromPublicationToApplication) {
  join();
  for (int i = 0; i < 100; ++i) {
    deliver(server.advance(wall_ns() + kFrameNs - 12 * kMs));
    poll(kFrameNs);
  }
  EXPECT_NEAR(figures().latency.quantile_ms(0.5), 12, 0.3);
}

TEST_F(PlayTest, AWallClockThatIsSetChangesNoLatency) {
  join();
  for (const std::int64_t off_s : {0, 3600, -3600, 50'000'000}) {
    for (int i = 0; i < 100; ++i) {
      deliver(server.advance(wall_ns() + kFrameNs - 12 * kMs));
      now_ns += kFrameNs;
      if (i % 10 == 0) {
        transport::ReplyMessage reply;
        reply.epoch = server.session.epoch;
        reply.client = kClient;
        reply.role = transport::Role::kParticipant;
        reply.phase = transport::Phase::kPlaying;
        reply.client_clock_ns = now_ns - 24 * kMs;
        reply.server_time_ns = wall_ns() - 12 * kMs;
        port.replies.push_back(from_server(reply));
      }
      core->poll({now_ns, wall_ns() + off_s * 1000 * kMs});
    }
  }
  EXPECT_NEAR(figures().latency.quantile_ms(0.5), 12, 0.3);
  EXPECT_GE(figures().latency.quantile_ms(0.001), 0);
  EXPECT_LE(figures().latency.quantile_ms(1), 40);
}

TEST_F(PlayTest, TheStatusGoesOutOnceASecond) {
  join();
  port.statuses.clear();
  for (int i = 0; i < 95; ++i) frame();
  EXPECT_EQ(port.statuses.size(), 3U);
  EXPECT_EQ(port.statuses.back().client, kClient);
  EXPECT_GT(port.statuses.back().mbit_per_s, 0);
  EXPECT_GT(port.statuses.back().frames_applied, 60U);
}

// A clock that goes on by so much whenever it is asked.
std::int64_t tick_ns = 0;
std::int64_t ticking_clock() {
  static std::int64_t now_ns = 0;
  return now_ns += tick_ns;
}

TEST_F(PlayTest, APollDoesTheWorkOfAFewFramesWhereTheseTakeLong) {
  measure_ns = ticking_clock;
  tick_ns = 15 * kMs;  // so that each frame takes at least 60 ms
  join();
  const std::uint64_t before = figures().frames_applied;
  for (int i = 0; i < 40; ++i) deliver(server.advance(wall_ns()));
  now_ns += kMs;
  for (std::uint64_t polls = 1; polls <= 40; ++polls) {
    const std::int64_t due_ns = core->poll({now_ns, wall_ns()});
    EXPECT_EQ(figures().frames_applied, before + polls) << "one, or it would get nowhere";
    EXPECT_TRUE(due_ns <= now_ns + kMs || polls == 40) << "it goes on at once";
  }
  expect_agreed();
  tick_ns = 0;
}

TEST_F(PlayTest, AClientWhoseMedianFrameTakesHalfAPeriodSaysSo) {
  measure_ns = ticking_clock;
  tick_ns = kMs;
  join();
  for (int i = 0; i < 70; ++i) frame();
  EXPECT_EQ(port.statuses.back().too_slow, 0U);
  tick_ns = 20 * kMs;
  for (int i = 0; i < 70; ++i) frame();
  EXPECT_EQ(port.statuses.back().too_slow, 1U);
  const auto says = [](const std::string& line) { return line.find("too slow") != std::string::npos; };
  EXPECT_EQ(std::ranges::count_if(log, says), 1) << "once an epoch";
  tick_ns = kMs;
  for (int i = 0; i < 70; ++i) frame();
  EXPECT_EQ(port.statuses.back().too_slow, 0U) << "of the last second alone";
}

}  // namespace
}  // namespace tandem::client
