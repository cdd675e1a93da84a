// Slow, frozen and dying clients, and a publisher that lags.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/fault/host/stage.hpp"

namespace tandem::host {
namespace {

TEST(Freeze, FrozenAndDeadClientsDelayTheOthersByTheStallTimeoutAtMost) {
  for_seeds(30, [](std::uint64_t seed) {
    Dice dice(seed);
    Stage stage(seed, {.delay_ns = 1'000'000 + static_cast<std::int64_t>(dice.below(15'000'000)),
                       .jitter_ns = 3'000'000});
    Server& server = stage.add_server(1'000'000);
    for (int i = 0; i < 5; ++i) stage.add_client();
    stage.run_ms(4000);
    ASSERT_EQ(server.host->participants(), 5U);

    std::int64_t longest_ns = 0, last_change_ns = stage.now_ns;
    Frame last = server.host->frame();
    stage.on_ms = [&] {
      if (server.host->frame() == last) return;
      longest_ns = std::max(longest_ns, stage.now_ns - last_change_ns);
      last_change_ns = stage.now_ns;
      last = server.host->frame();
    };
    const std::uint64_t victims = 1 + dice.below(4);
    for (std::uint64_t i = 1; i <= victims; ++i) {
      if (dice.one_in(3)) {
        stage.clients[i]->frozen = true;
        stage.network.kill(stage.clients[i]->port->self());
      } else {
        stage.set_frozen(*stage.clients[i], true);
      }
    }
    stage.run_ms(3000);
    // A period passes anyway, and a round trip of up to 38 ms until the living clients have acknowledged.
    EXPECT_LE(longest_ns, kSecond / 2 + 72 * kMillisecond);
    EXPECT_EQ(server.host->participants(), 5U - victims);
    EXPECT_EQ(stage.clients[0]->core->statistics().resyncs, 0U);
  });
}

TEST(Freeze, AThawedClientIsDemotedReturnsAfterTenSecondsAndMaySendAgain) {
  for_seeds(5, [](std::uint64_t seed) {
    Stage stage(seed, {.delay_ns = 3'000'000});
    HostConfig config;
    config.window = 2;  // an automatic one may grow in a stall, and leave little of it
    Server& server = stage.add_server(1'000'000, std::move(config));
    stage.add_client();
    Client& sleeper = stage.add_client();
    stage.run_ms(3000);
    stage.set_frozen(sleeper, true);
    stage.run_ms(900);
    stage.set_frozen(sleeper, false);
    stage.run_ms(2000);
    EXPECT_EQ(server.host->totals().demotions, 1U);
    EXPECT_EQ(sleeper.core->status().role, ClientRole::kObserver);
    static_cast<void>(
        sleeper.core->send(transport::InputKind::kGravity, {0, -1, 0}, {}, {stage.now_ns, stage.wall_ns()}));
    stage.run_ms(500);
    EXPECT_EQ(sleeper.core->statistics().inputs_refused, 1U);
    stage.run_ms(10'000);
    EXPECT_EQ(server.host->participants(), 2U);
    ASSERT_TRUE(
        sleeper.core->send(transport::InputKind::kGravity, {0, -1, 0}, {}, {stage.now_ns, stage.wall_ns()}));
    stage.run_ms(500);
    EXPECT_EQ(sleeper.core->statistics().inputs_acted, 1U);
  });
}

TEST(Freeze, APublisherThatLagsSuspendsTheServerAndNothingIsLost) {
  for_seeds(20, [](std::uint64_t seed) {
    Dice dice(seed);
    Stage stage(seed, {.delay_ns = 2'000'000, .jitter_ns = 2'000'000});
    Server& server = stage.add_server(1'000'000);
    Client& client = stage.add_client();
    Client& observer = stage.add_client(transport::Role::kObserver);
    stage.run_ms(3000);
    for (int i = 0; i < 20; ++i) {
      server.publishes = false;
      stage.run_ms(static_cast<std::int64_t>(dice.below(700)));
      server.publishes = true;
      stage.run_ms(static_cast<std::int64_t>(dice.below(200)));
    }
    stage.run_ms(1000);
    EXPECT_EQ(server.host->totals().demotions, 0U);
    EXPECT_EQ(client.core->statistics().resyncs, 0U);
    EXPECT_EQ(observer.core->statistics().resyncs, 0U);
    EXPECT_GE(client.core->timeline()->applied() + 3, server.host->frame());
    EXPECT_LE(server.host->outbox().high_water(), 64U);
  });
}

TEST(Freeze, ManyJoinersAtOnceShareFewSnapshotsAndAllPlay) {
  for_seeds(5, [](std::uint64_t seed) {
    Stage stage(seed, {.delay_ns = 2'000'000, .jitter_ns = 10'000'000});
    Server& server = stage.add_server(1'000'000);
    stage.run_ms(2000);
    for (int i = 0; i < 40; ++i)
      stage.add_client(i % 2 == 0 ? transport::Role::kParticipant : transport::Role::kObserver);
    stage.run_ms(2000);
    for (const auto& client : stage.clients) EXPECT_TRUE(Stage::plays(*client, *server.host));
    EXPECT_LE(server.host->totals().snapshots, 8U);
    EXPECT_EQ(server.host->participants(), 20U);
    EXPECT_EQ(server.host->observers(), 20U);
  });
}

}  // namespace
}  // namespace tandem::host
