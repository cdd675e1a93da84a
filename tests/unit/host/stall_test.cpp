// Tests which client delays the others, for how long, and with what consequences.
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using transport::Phase;
using transport::Reason;
using transport::Role;

// Clients that acknowledge every frame at once while listed in `awake`.
class StallTest : public ::testing::Test {
 protected:
  explicit StallTest(HostConfig config = config_of_two()) : bench(std::move(config)) {
    bench.poll();
    bench.on_ms = [this] {
      for (const transport::ClientId id : awake) bench.playing(id, bench.host->frame());
    };
  }
  static HostConfig config_of_two() {
    HostConfig config = test_config();
    config.window = 2;
    return config;
  }
  void enter(transport::ClientId id) {
    bench.enter(id);
    awake.insert(id);
  }
  // Longest time without a new frame while `ms` pass.
  std::int64_t longest_pause_ms(std::int64_t ms) {
    std::int64_t longest = 0, pause = 0;
    Frame last = bench.host->frame();
    for (std::int64_t i = 0; i < ms; ++i) {
      bench.run_ms(1);
      pause = bench.host->frame() == last ? pause + 1 : 0;
      last = bench.host->frame();
      longest = std::max(longest, pause);
    }
    return longest;
  }
  [[nodiscard]] Role role(transport::ClientId id) const { return bench.last_reply(id)->role; }

  Bench bench;
  std::set<transport::ClientId> awake;
};

TEST_F(StallTest, AFrozenParticipantDelaysTheOthersByTheStallTimeoutAtMost) {
  enter(1);
  enter(2);
  bench.run_ms(1000);
  awake.erase(2);
  const std::int64_t pause = longest_pause_ms(5000);
  EXPECT_GE(pause, 500);
  EXPECT_LE(pause, 500 + 34 + 5);
  EXPECT_EQ(bench.host->participants(), 1U);
  EXPECT_EQ(bench.host->totals().stalls, 1U);
  EXPECT_NEAR(static_cast<double>(bench.host->totals().suspended_ms), 500, 5);
}

TEST_F(StallTest, AStallTimeoutThatChangesHoldsFromThenOn) {
  enter(1);
  enter(2);
  bench.run_ms(1000);
  ASSERT_TRUE(bench.host->set_limits(256, 200'000'000));
  awake.erase(2);
  const std::int64_t pause = longest_pause_ms(5000);
  EXPECT_GE(pause, 200);
  EXPECT_LE(pause, 200 + 34 + 5);
  EXPECT_EQ(bench.host->participants(), 1U);
}

TEST_F(StallTest, SeveralFrozenAtOnceDelayNoLongerThanOne) {
  for (transport::ClientId id = 1; id <= 5; ++id) enter(id);
  bench.run_ms(1000);
  awake = {1};
  EXPECT_LE(longest_pause_ms(5000), 500 + 34 + 5);
  EXPECT_EQ(bench.host->participants(), 1U);
}

TEST_F(StallTest, OneParticipantWhoseClientsFreezeInTurnDelaysNoLongerThanOneClient) {
  enter(1);
  constexpr transport::ClientId kFirst = 100, kCount = 16;
  for (const bool plays : {false, true}) {
    for (transport::ClientId id = kFirst; id < kFirst + kCount; ++id) {
      bench.port.acks.push_back(
          {bench.ack(id, plays ? Phase::kPlaying : Phase::kJoining, plays ? bench.host->frame() : 0),
           participant(9)});
    }
    bench.run_ms(5);
  }
  ASSERT_EQ(bench.host->participants(), 1 + kCount);
  std::int64_t ms = 0;
  bench.on_ms = [&] {
    bench.playing(1, bench.host->frame());
    const transport::ClientId frozen = kFirst + static_cast<transport::ClientId>(ms++ / 450) % kCount;
    for (transport::ClientId id = kFirst; id < kFirst + kCount; ++id) {
      if (id == frozen) continue;
      bench.port.acks.push_back({bench.ack(id, Phase::kPlaying, bench.host->frame()), participant(9)});
    }
  };
  const Frame before = bench.host->frame();
  bench.run_ms(30'000);
  EXPECT_GE(bench.host->frame() - before, 900U * 93 / 100)
      << "0.5 s of each 10 s at most, and the return of many";
  EXPECT_LE(bench.host->totals().suspended_ms, 3 * 600U);
}

TEST_F(StallTest, ADemotedClientIsToldSoByAReply) {
  enter(1);
  enter(2);
  EXPECT_EQ(role(2), Role::kParticipant);
  awake.erase(2);
  bench.run_ms(1000);
  EXPECT_EQ(role(2), Role::kObserver);
  EXPECT_EQ(bench.last_reply(2)->reason, static_cast<std::uint32_t>(Reason::kDemoted));
  EXPECT_EQ(bench.host->totals().demotions, 1U);
}

TEST_F(StallTest, InputsOfADemotedClientAreRefusedWithThatReason) {
  enter(1);
  enter(2);
  awake.erase(2);
  bench.run_ms(1000);
  bench.send(bench.gravity(2, 1));
  bench.run_ms(20);
  EXPECT_EQ(bench.refusal(2, 1), Reason::kDemoted);
  EXPECT_TRUE(bench.port.scheduled.empty());
}

TEST_F(StallTest, StallsAddUpOverTenSeconds) {
  enter(1);
  enter(2);
  for (int i = 0; i < 2; ++i) {  // twice 0.3 s, 4 s apart
    awake.erase(2);
    bench.run_ms(300 + 100);  // two frames of window pass before the server suspends
    awake.insert(2);
    bench.run_ms(i == 0 ? 4000 : 100);
  }
  EXPECT_EQ(bench.host->totals().demotions, 1U);
}

TEST_F(StallTest, StallsFurtherApartAreForgiven) {
  enter(1);
  enter(2);
  for (int i = 0; i < 4; ++i) {
    awake.erase(2);
    bench.run_ms(400);
    awake.insert(2);
    bench.run_ms(11'000);
  }
  EXPECT_GE(bench.host->totals().stalls, 4U);
  EXPECT_EQ(bench.host->totals().demotions, 0U);
  EXPECT_EQ(bench.host->participants(), 2U);
}

TEST_F(StallTest, ADemotedClientIsAParticipantAgainAfterKeepingUpForTenSeconds) {
  enter(1);
  enter(2);
  awake.erase(2);
  bench.run_ms(2000);
  awake.insert(2);
  bench.run_ms(9'900);
  EXPECT_EQ(bench.host->participants(), 1U);
  EXPECT_EQ(role(2), Role::kObserver);
  bench.run_ms(200);
  EXPECT_EQ(bench.host->participants(), 2U);
  EXPECT_EQ(role(2), Role::kParticipant);
  EXPECT_EQ(bench.last_reply(2)->reason, static_cast<std::uint32_t>(Reason::kNone));
  bench.send(bench.gravity(2, 1));
  bench.run_ms(20);
  EXPECT_EQ(bench.refusal(2, 1), Reason::kNone);
  EXPECT_EQ(bench.port.scheduled.size(), 1U);
}

TEST_F(StallTest, FallingBehindOnceStartsTheTenSecondsAgain) {
  enter(1);
  enter(2);
  awake.erase(2);
  bench.run_ms(2000);
  awake.insert(2);
  bench.run_ms(8000);
  awake.erase(2);
  bench.run_ms(150);  // more than two frames
  awake.insert(2);
  bench.run_ms(9'800);
  EXPECT_EQ(bench.host->participants(), 1U);
  bench.run_ms(400);
  EXPECT_EQ(bench.host->participants(), 2U);
}

TEST_F(StallTest, TheAccountSurvivesARejoin) {
  enter(1);
  enter(2);
  awake.erase(2);
  bench.run_ms(2000);
  ASSERT_EQ(role(2), Role::kObserver);
  bench.joining(2, 2);
  bench.run_ms(300);
  bench.send(bench.ack(2, Phase::kPlaying, bench.host->frame(), Role::kParticipant, 2));
  bench.run_ms(50);
  EXPECT_EQ(role(2), Role::kObserver);
  EXPECT_EQ(bench.last_reply(2)->reason, static_cast<std::uint32_t>(Reason::kDemoted));
  EXPECT_EQ(bench.host->participants(), 1U);
}

TEST_F(StallTest, ChargesBeforeARejoinStillCount) {
  enter(1);
  enter(2);
  awake.erase(2);
  bench.run_ms(400);  // about 0.3 s of suspension
  bench.joining(2, 2);
  bench.run_ms(300);
  bench.send(bench.ack(2, Phase::kPlaying, bench.host->frame(), Role::kParticipant, 2));
  bench.run_ms(400);
  EXPECT_EQ(bench.host->totals().demotions, 1U);
}

TEST_F(StallTest, ADeadParticipantIsLetGoBeforeTheTimeout) {
  enter(1);
  enter(2);
  bench.run_ms(500);
  awake.erase(2);
  bench.port.dead.insert(participant(2));
  EXPECT_LE(longest_pause_ms(2000), 34 + 60);
  EXPECT_EQ(bench.host->totals().demotions, 0U);
}

TEST_F(StallTest, APauseOfTheServerItselfIsNotCharged) {
  enter(1);
  enter(2);
  awake.erase(2);
  bench.run_ms(200);  // suspended, waiting for client 2
  bench.now += 5 * kSecond;
  bench.poll();
  awake.insert(2);
  bench.run_ms(100);
  EXPECT_EQ(bench.host->totals().demotions, 0U);
}

TEST_F(StallTest, WaitingForTheQueueIsNobodysFault) {
  enter(1);
  bench.draining = false;
  bench.run_ms(3000);
  EXPECT_EQ(bench.host->totals().stalls, 0U);
  EXPECT_EQ(bench.host->totals().demotions, 0U);
  EXPECT_GT(bench.host->totals().suspended_ms, 2000U);
}

TEST_F(StallTest, NobodyIsToBlameForADeltaThatWasNotWrittenYet) {
  enter(1);
  bench.run_ms(500);
  awake.clear();
  bench.playing(1, bench.host->frame());  // all that was written
  bench.draining = false;
  bench.run_ms(3000);
  EXPECT_EQ(bench.host->totals().demotions, 0U);
  EXPECT_EQ(bench.host->totals().stalls, 0U);
  bench.draining = true;
  bench.run_ms(1000);
  EXPECT_EQ(bench.host->totals().demotions, 1U) << "now it is";
}

TEST_F(StallTest, TheHostAsksToBeWokenWhenSomebodysPatienceEnds) {
  enter(1);
  awake.clear();
  bench.on_ms = nullptr;
  // From here on only the host's own wishes drive the clock.
  std::int64_t demoted_at = 0, suspended_at = 0;
  for (int i = 0; i < 200 && demoted_at == 0; ++i) {
    bench.now = std::max(bench.now + 1, bench.host->next_wake_ns());
    bench.poll();
    if (suspended_at == 0 && bench.host->totals().stalls == 1) suspended_at = bench.now;
    if (bench.host->totals().demotions == 1) demoted_at = bench.now;
  }
  ASSERT_NE(demoted_at, 0);
  EXPECT_LE(demoted_at - suspended_at, kSecond / 2 + 2 * kMillisecond);
}

class NoStallTimeout : public StallTest {
 protected:
  NoStallTimeout() : StallTest(config()) {}
  static HostConfig config() {
    HostConfig config = config_of_two();
    config.stall_timeout_ns.reset();
    return config;
  }
};

TEST_F(NoStallTimeout, NobodyIsDemotedHoweverLongItTakes) {
  enter(1);
  enter(2);
  awake.erase(2);
  bench.run_ms(20'000);
  EXPECT_EQ(bench.host->participants(), 2U);
  const Frame held = bench.host->frame();
  bench.run_ms(1000);
  EXPECT_EQ(bench.host->frame(), held);
  EXPECT_EQ(bench.host->totals().stalls, 1U);
}

}  // namespace
}  // namespace tandem::host
