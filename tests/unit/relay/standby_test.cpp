// Two relays of a session at one site, and relays behind relays.

#include <gtest/gtest.h>

#include "tests/unit/relay/stage.hpp"

namespace tandem::relay {
namespace {

/// `first` has what start_near() made; a second relay beside it stands by.
void start_both(Stage& stage, std::uint32_t streams = 1) {
  stage.start_server(1000, streams);
  stage.start_near();
  stage.run_ms(2500);
  stage.second = std::move(stage.near);
  stage.start_near();
  std::swap(stage.near, stage.second);
  stage.run_ms(3000);
}

TEST(StandingBy, TheSecondRelayTakesOverAndNobodyJoinsAnew) {
  Stage stage(5);
  start_both(stage);
  EXPECT_TRUE(stage.second->relay->stands_by());
  EXPECT_EQ(stage.second->relay->obstacle(), nullptr);
  stage.start_far();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  Watcher& far = stage.add_far();
  stage.run_ms(4000);
  ASSERT_TRUE(edge.plays() && far.plays());
  stage.near.reset();  // its last beat says that it leaves
  stage.run_ms(4000);
  EXPECT_FALSE(stage.second->relay->stands_by());
  EXPECT_GE(edge.frame() + 6, near.frame());
  EXPECT_GE(far.frame() + 6, near.frame());
  EXPECT_EQ(edge.resyncs() + far.resyncs(), 0U);
  Stage::expect_same(near, edge, 150);
  Stage::expect_same(near, far, 150);
}

TEST(StandingBy, ItTakesOverFromARelayThatIsNotHeardAnyMore) {
  Stage stage(6);
  start_both(stage);
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(4000);
  ASSERT_TRUE(edge.plays());
  stage.first_bus->cut = true;  // as if it were killed: it says nothing more
  stage.run_ms(5000);
  EXPECT_FALSE(stage.second->relay->stands_by());
  EXPECT_GE(edge.frame() + 6, near.frame());
  EXPECT_EQ(edge.resyncs(), 0U);
  // The first comes back: one of them goes on, and both have the same frames.
  stage.first_bus->cut = false;
  stage.run_ms(8000);
  EXPECT_NE(stage.near->relay->stands_by(), stage.second->relay->stands_by());
  EXPECT_GE(edge.frame() + 6, near.frame());
  EXPECT_EQ(edge.resyncs(), 0U);
  Stage::expect_same(near, edge, 400);
}

// On a domain where anybody may announce; on NATS, permissions keep such out.
TEST(StandingBy, ARelayGivesNoWayToWhoAnnouncesItsEpoch) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Stage stage(seed);
    stage.start_server();
    stage.start_near();
    stage.start_far();
    const Watcher& near = stage.add_near();
    Watcher& far = stage.add_far();
    stage.run_ms(6000);
    ASSERT_TRUE(far.plays());
    const auto imitator = stage.imitate_far(stage.far->relay->host()->session());
    stage.run_ms(8000);
    EXPECT_FALSE(stage.far->relay->stands_by()) << "seed " << seed;
    EXPECT_EQ(far.resyncs(), 0U);
    EXPECT_GE(far.frame() + 6, near.frame());
  }
}

TEST(StandingBy, AllStreamsGoOn) {
  Stage stage(7);
  start_both(stage, 2);
  Watcher& rich = stage.add_edge("edge", "rich");
  Watcher& thin = stage.add_edge("other", "thin");
  stage.run_ms(4000);
  ASSERT_TRUE(rich.plays() && thin.plays());
  stage.near.reset();
  const Frame before = rich.frame();
  stage.run_ms(5000);
  EXPECT_GT(rich.frame(), before + 100);
  EXPECT_GT(thin.frame(), before + 100);
  EXPECT_EQ(rich.resyncs() + thin.resyncs(), 0U);
}

TEST(Chain, ARelayPassesOnWhatAnotherPassesOn) {
  Stage stage(8);
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  transport::FakeNats beyond(9);
  const auto port_options = [&](const char* site, transport::ClientId id, std::uint32_t sender) {
    return transport::NatsPortOptions{
        .session = "default", .site = site, .client = id, .sender = sender, .clock = [&stage] {
          return stage.now_ns;
        }};
  };
  Passing middle(
      [&](transport::ClientId id) -> Result<std::unique_ptr<transport::ClientPort>> {
        return std::unique_ptr<transport::ClientPort>{std::make_unique<transport::NatsClientPort>(
            port_options("middle", id, 70), stage.nats.connect())};
      },
      [&](const transport::SessionMessage&) -> Result<std::unique_ptr<transport::ServerPort>> {
        return std::unique_ptr<transport::ServerPort>{
            std::make_unique<transport::NatsServerPort>(port_options("middle", 0, 71), beyond.connect())};
      },
      5000);
  Watcher last(6000,
               std::make_unique<transport::NatsClientPort>(port_options("last", 6000, 72), beyond.connect()),
               "0");
  const auto run_ms = [&](int ms) {
    for (int i = 0; i < ms; ++i) {
      stage.run_ms(1);
      beyond.now_ns = stage.now_ns;
      const client::Now now{stage.now_ns, stage.now_ns + 1'700'000'000 * kSecond};
      middle.poll(now);
      last.core->poll(now);
    }
  };
  run_ms(4000);
  ASSERT_TRUE(last.plays());
  stage.nats.loss = beyond.loss = 0.05;
  ASSERT_TRUE(last.core->send(transport::InputKind::kGravity, {1, -9, 0}, {},
                              {stage.now_ns, stage.now_ns + 1'700'000'000 * kSecond}));
  run_ms(8000);
  stage.nats.loss = beyond.loss = 0;
  run_ms(1000);
  EXPECT_EQ(last.core->session()->epoch, 1000U);
  EXPECT_GE(last.frame() + 6, near.frame());
  EXPECT_EQ(last.resyncs(), 0U);
  ASSERT_EQ(last.outcomes.size(), 1U);
  EXPECT_EQ(last.outcomes[0].kind, client::InputOutcome::Kind::kActed);
  Stage::expect_same(near, last, 300);
}

}  // namespace
}  // namespace tandem::relay
