#include <algorithm>
#include <string>

#include "sdk/client/following/lag_limit.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

constexpr std::int64_t kS = 1000 * kMs;

TEST(LagLimit, FiveSecondsOfFramesMayWaitForAsLongAsTheyLike) {
  LagLimit limit(30);
  for (std::int64_t s = 0; s < 1000; ++s) EXPECT_FALSE(limit.exceeded(150, s * kS));
}

TEST(LagLimit, MoreThanThatIsBorneForFiveSeconds) {
  LagLimit limit(30);
  EXPECT_FALSE(limit.exceeded(151, 0));
  EXPECT_FALSE(limit.exceeded(200, 5 * kS - 1));
  EXPECT_TRUE(limit.exceeded(160, 5 * kS));
}

TEST(LagLimit, WhoHalvesWhatWaitsWithinFiveSecondsCatchesUp) {
  LagLimit limit(30);
  std::size_t waiting = 9000;
  for (std::int64_t s = 0; waiting > 10; s += 4, waiting /= 2) EXPECT_FALSE(limit.exceeded(waiting, s * kS));
}

TEST(LagLimit, TheTimeBeginsAnewOnceFewWait) {
  LagLimit limit(30);
  EXPECT_FALSE(limit.exceeded(200, 0));
  EXPECT_FALSE(limit.exceeded(150, 3 * kS));
  EXPECT_FALSE(limit.exceeded(200, 5 * kS));
  limit.reset();
  EXPECT_FALSE(limit.exceeded(200, 10 * kS));
}

class LagTest : public ClientTest {
 protected:
  /// Polls take so long that more frames come than one of them applies.
  void fall_behind() {
    for (int polls = 0; polls < 20 && core->phase() == ClientPhase::kPlaying; ++polls) {
      for (int i = 0; i < 100; ++i) deliver(server.advance(wall_ns()));
      poll(100 * kFrameNs);
    }
  }
  [[nodiscard]] std::uint64_t lag_resyncs() const {
    return figures().resyncs_by_reason[static_cast<std::size_t>(ResyncReason::kLag)];
  }
};

TEST_F(LagTest, AClientThatIsTooSlowJoinsAgainAndSaysSoOnce) {
  join();
  for (std::uint64_t times = 1; times <= 2; ++times) {
    fall_behind();
    ASSERT_EQ(core->phase(), ClientPhase::kJoining);
    EXPECT_EQ(lag_resyncs(), times);
    poll(100 * kMs);
    port.snapshots.push_back(from_server(server.snapshot()));
    poll();
    ASSERT_EQ(core->phase(), ClientPhase::kPlaying);
    EXPECT_EQ(core->timeline()->applied(), server.frame());
  }
  const auto told = std::ranges::count_if(
      log, [](const std::string& line) { return line.find("too far behind") != std::string::npos; });
  EXPECT_EQ(told, 1);
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(figures().resyncs, 2U);
  expect_agreed();
}

TEST_F(LagTest, WhatALostLinkHeldBackIsMadeUpFor) {
  join();
  for (int i = 0; i < 900; ++i) deliver(server.advance(wall_ns()));
  poll(30 * kS);
  EXPECT_LT(core->timeline()->applied(), server.frame()) << "not all of it in one poll";
  port.acks.clear();
  for (int i = 0; i < 20; ++i) poll(30 * kMs);
  EXPECT_EQ(core->timeline()->applied(), server.frame());
  EXPECT_GT(port.acks.size(), 10U) << "acknowledges meanwhile";
  EXPECT_EQ(figures().resyncs, 0U);
  expect_agreed();
}

TEST_F(LagTest, AClientThatIsBehindAsksToBeCalledAgainAtOnce) {
  join();
  for (int i = 0; i < 200; ++i) deliver(server.advance(wall_ns()));
  now_ns += kMs;
  EXPECT_LE(core->poll({now_ns, wall_ns()}), now_ns + kMs);
}

}  // namespace
}  // namespace tandem::client
