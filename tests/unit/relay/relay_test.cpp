#include "services/relay/relay.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numeric>

#include "sdk/wire/envelope.hpp"
#include "sdk/wire/frame_bundle.hpp"
#include "services/relay/relay_source.hpp"
#include "tests/unit/relay/stage.hpp"

namespace tandem::relay {
namespace {

using transport::InputKind;
using Outcome = client::InputOutcome::Kind;

TEST(Relay, WhoFollowsOverNatsAppliesEveryFrameOfTheServer) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(6000);
  ASSERT_TRUE(edge.plays());
  EXPECT_EQ(edge.core->session()->epoch, 1000U);
  Stage::expect_same(near, edge, 90);
  EXPECT_EQ(edge.resyncs(), 0U);
  EXPECT_GE(edge.frame() + 3, near.frame());
}

TEST(Relay, KeysAndEventsOfTheServerReachEveryFollowerOnce) {
  Stage stage;
  stage.features = {.keys = true, .events = true};
  stage.start_server();
  stage.start_near();
  stage.start_far();
  const std::array<Watcher*, 3> all{&stage.add_near(), &stage.add_edge(), &stage.add_far()};
  stage.run_ms(6000);
  for (const Watcher* watcher : all) ASSERT_TRUE(watcher->plays());
  ASSERT_TRUE(stage.server->news()->set_key("score", {}));
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(stage.server->news()->broadcast(1, {}, 2));
    stage.run_ms(10);
  }
  stage.run_ms(3000);
  std::vector<std::uint64_t> numbers(300);
  std::iota(numbers.begin(), numbers.end(), 1U);
  for (const Watcher* watcher : all) {
    EXPECT_EQ(watcher->events, numbers);
    EXPECT_EQ(watcher->lost, 0U);
    EXPECT_EQ(watcher->core->keys().size(), 1U);
  }
  Stage::expect_same(*all[0], *all[2], 200);
}

TEST(Relay, AnotherSitesDomainHasTheSameEpochFramesAndHashes) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  stage.start_far();
  Watcher& near = stage.add_near();
  Watcher& far = stage.add_far();
  stage.run_ms(6000);
  ASSERT_TRUE(far.plays());
  EXPECT_EQ(far.core->session()->epoch, 1000U);
  Stage::expect_same(near, far, 80);
}

TEST(Relay, OfAStreamInTwoDelaysTheOfferThatEncodesIsPassedOn) {
  Stage stage;
  stage.start_server(1000, 2, true);
  stage.start_near();
  stage.start_far();
  Watcher& near = stage.add_near("rich");
  Watcher& far = stage.add_far("rich", transport::Role::kObserver);
  stage.run_ms(6000);
  ASSERT_TRUE(near.plays() && far.plays());
  EXPECT_EQ(near.core->session()->streams.size(), 4U);
  ASSERT_EQ(far.core->session()->streams.size(), 2U);
  for (const transport::StreamMessage& stream : far.core->session()->streams) {
    EXPECT_EQ(stream.carries, stream.id.id);
    EXPECT_EQ(stream.delay_ms, 0U);
  }
  Stage::expect_same(near, far, 80);
}

TEST(Relay, ADeltaGoesOutOnceForAnyNumberOfFollowers) {
  Stage stage;
  stage.nats.counts = [](const std::string& subject) { return subject.starts_with("tandem.default.delta."); };
  stage.start_server();
  stage.start_near();
  for (int i = 0; i < 5; ++i) stage.add_edge("edge" + std::to_string(i));
  stage.run_ms(3000);
  const std::uint64_t before = stage.nats.published;
  const Frame frame = stage.near->relay->host()->frame();
  stage.run_ms(3000);
  EXPECT_EQ(stage.nats.published - before, stage.near->relay->host()->frame() - frame);
}

TEST(Relay, WhatIsLostOnTheWayIsAskedForAndNobodyJoinsAnew) {
  Stage stage(3);
  stage.start_server();
  stage.start_near();
  stage.start_far();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  Watcher& far = stage.add_far();
  stage.run_ms(3000);
  ASSERT_TRUE(edge.plays() && far.plays());
  stage.nats.loss = 0.05;
  stage.nats.delay_ns = 40 * kMillisecond;
  ASSERT_TRUE(near.core->send(InputKind::kGravity, {1, -9, 0}, {}, stage.clocks()));
  stage.run_ms(20'000);
  EXPECT_EQ(edge.resyncs(), 0U);
  EXPECT_EQ(far.resyncs(), 0U);
  EXPECT_GT(stage.edge_port->counts()->repaired, 10U);
  stage.nats.loss = 0;
  stage.run_ms(1000);
  Stage::expect_same(near, edge, 600);
  Stage::expect_same(near, far, 600);
  EXPECT_GE(edge.frame() + 6, near.frame());
}

TEST(Relay, AfterACutOfTwentySecondsAllCatchUpWithoutASnapshot) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  stage.start_far();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  Watcher& far = stage.add_far();
  stage.run_ms(3000);
  stage.nats.delay_ns = 40 * kMillisecond;
  stage.far_bus->cut = stage.edge_bus->cut = true;
  stage.run_ms(20'000);
  EXPECT_TRUE(far.core->server_alive()) << "the far relay goes on announcing the session";
  stage.far_bus->cut = stage.edge_bus->cut = false;
  stage.run_ms(2000);
  EXPECT_GE(edge.frame() + 9, near.frame());
  EXPECT_GE(far.frame() + 9, near.frame());
  EXPECT_EQ(edge.resyncs() + far.resyncs() + near.resyncs(), 0U);
  EXPECT_EQ(far.core->join_attempt(), 1U);
  Stage::expect_same(near, far, 650);
}

TEST(Relay, AfterACutThatNobodyCanCatchUpWithTheyJoinAnew) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  stage.nats.down = true;
  stage.run_ms(36'000);
  stage.nats.down = false;
  stage.run_ms(3000);
  EXPECT_TRUE(edge.plays());
  EXPECT_GE(edge.resyncs(), 1U);
  EXPECT_GE(edge.frame() + 6, near.frame());
  Stage::expect_same(near, edge, 100);
}

TEST(Relay, AServerThatBeginsAnewIsFollowed) {
  Stage stage;
  stage.start_server(1000);
  stage.start_near();
  stage.start_far();
  Watcher& edge = stage.add_edge();
  Watcher& far = stage.add_far();
  stage.run_ms(3000);
  ASSERT_TRUE(edge.plays() && far.plays());
  stage.stop_server();
  stage.run_ms(500);
  stage.start_server(5000);
  stage.run_ms(4000);
  ASSERT_TRUE(edge.plays() && far.plays());
  EXPECT_EQ(edge.core->session()->epoch, 5000U);
  EXPECT_EQ(far.core->session()->epoch, 5000U);
  Stage::expect_same(edge, far, 60);
}

TEST(Relay, ARelayThatIsRestartedIsFollowedAgain) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  stage.near.reset();
  stage.run_ms(1000);
  stage.start_near();
  stage.run_ms(2500);
  ASSERT_TRUE(edge.plays());
  EXPECT_GE(edge.frame() + 6, near.frame());
  Stage::expect_same(near, edge, 60);
}

TEST(Relay, EachHearsTheOutcomeOfItsInputs) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  stage.start_far();
  Watcher& edge = stage.add_edge();
  Watcher& far = stage.add_far();
  Watcher& observer = stage.add_far("0", transport::Role::kObserver);
  stage.run_ms(3000);
  ASSERT_TRUE(far.plays() && edge.plays() && observer.plays());
  ASSERT_TRUE(far.core->send(InputKind::kGravity, {1, -9, 0}, {}, stage.clocks()));
  ASSERT_TRUE(far.core->send(InputKind::kPush, {0, 0, 0, 1, 500, 0, 0}, {}, stage.clocks()));
  ASSERT_TRUE(edge.core->send(InputKind::kPush, {0, 0, 0, 1, 1, 0, 0}, {}, stage.clocks()));
  stage.run_ms(1000);
  ASSERT_EQ(far.outcomes.size(), 2U);
  std::sort(far.outcomes.begin(), far.outcomes.end(),
            [](const auto& a, const auto& b) { return a.number < b.number; });
  EXPECT_EQ(far.outcomes[0].kind, Outcome::kActed);
  EXPECT_GT(far.outcomes[0].frame, 0U);
  EXPECT_EQ(far.outcomes[1].kind, Outcome::kRefused);
  EXPECT_EQ(far.outcomes[1].text, "beyond 100") << "the simulation's own words";
  ASSERT_EQ(edge.outcomes.size(), 1U);
  EXPECT_EQ(edge.outcomes[0].kind, Outcome::kActed);
  EXPECT_EQ(stage.simulation->acted.size(), 2U);
  EXPECT_EQ(far.resyncs() + edge.resyncs() + observer.resyncs(), 0U);
}

// It was published later without its values, and everybody's state became another one.
TEST(Relay, AnInputThatWaitsForRoomKeepsItsValues) {
  Stage stage;
  stage.start_server();
  Watcher& near = stage.add_near();
  const auto upstream =
      must(Upstream::create({.new_id = [] { return transport::ClientId{9000}; }},
                            [&](transport::ClientId) -> Result<std::unique_ptr<transport::ClientPort>> {
                              return stage.near_port();
                            }));
  const auto run_ms = [&](int ms) {
    for (int i = 0; i < ms; ++i) {
      stage.run_ms(1);
      upstream->poll(stage.clocks());
    }
  };
  run_ms(3000);
  ASSERT_TRUE(upstream->first().playing());
  RelaySource source(*upstream);
  ASSERT_TRUE(near.core->send(InputKind::kGravity, {1, -9, 0}, {}, stage.clocks()));
  run_ms(500);
  const auto sent = upstream->first().scheduled();
  ASSERT_EQ(sent.size(), 1U);
  ASSERT_FALSE(sent.front().values.empty());
  host::Outbox full(host::Outbox::Limits{.control = 0}), empty(host::Outbox::Limits{});
  static_cast<void>(source.next({}, full));
  EXPECT_EQ(full.size(), 0U);
  static_cast<void>(source.next({}, empty));
  const auto published = empty.pop(std::chrono::nanoseconds{0});
  ASSERT_TRUE(published);
  EXPECT_EQ(std::get<transport::ScheduledInputMessage>(*published), sent.front());
}

// What every frame costs, for nothing: all that follow over NATS check the hashes themselves.
TEST(Relay, BesideTheServerItHasAStateOnlyWhileSomebodyJoins) {
  Stage stage(4);
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(4000);
  ASSERT_TRUE(edge.plays());
  EXPECT_TRUE(stage.near->upstream->first().holds_state());
  ASSERT_TRUE(edge.core->send(InputKind::kGravity, {1, -9, 0}, {}, stage.clocks()));
  stage.run_ms(12'000);
  EXPECT_FALSE(stage.near->upstream->first().holds_state());
  const auto snapshots = [&] { return stage.server->totals().snapshots; };
  const std::uint64_t before = snapshots();
  // Inputs go on to act while the relay fetches a state for who joins.
  Watcher& late = stage.add_edge("late");
  Watcher& later = stage.add_edge("later");
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(edge.core->send(InputKind::kPush, {0, 0, 0, 1, 1, 0, 0}, {}, stage.clocks()));
    stage.run_ms(60);
  }
  stage.run_ms(400);
  ASSERT_TRUE(late.plays() && later.plays());
  EXPECT_EQ(snapshots() - before, 1U);
  EXPECT_EQ(stage.near->upstream->first().joins(), 1U) << "it did not join anew";
  EXPECT_EQ(edge.resyncs() + late.resyncs() + near.resyncs(), 0U);
  EXPECT_EQ(late.core->statistics().hash_mismatches, 0U);
  ASSERT_EQ(edge.outcomes.size(), 11U);
  for (const auto& outcome : edge.outcomes) EXPECT_EQ(outcome.kind, Outcome::kActed);
  stage.run_ms(14'000);
  EXPECT_FALSE(stage.near->upstream->first().holds_state());
  Stage::expect_same(near, late, 300);
  Stage::expect_same(near, edge, 600);
}

TEST(Relay, AFollowerHoldsNobodyUp) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  stage.add_edge();
  stage.run_ms(3000);
  const Frame before = near.frame();
  stage.edge_bus->cut = true;
  stage.run_ms(3000);
  EXPECT_GE(near.frame() - before, 85U);
}

TEST(Relay, StreamsAreFollowedWhereSomebodyPlaysThem) {
  Stage stage;
  stage.nats.counts = [](const std::string& subject) { return subject == "tandem.default.delta.1"; };
  stage.start_server(1000, 2);
  stage.start_near();
  stage.start_far();
  Watcher& thin = stage.add_far("thin");
  stage.run_ms(4000);
  ASSERT_TRUE(thin.plays());
  EXPECT_EQ(stage.nats.published, 0U) << "nobody plays the rich stream";
  EXPECT_EQ(stage.near->upstream->feed(1), nullptr);
  Watcher& near = stage.add_near("rich");
  Watcher& rich = stage.add_far("rich");
  stage.run_ms(4000);
  ASSERT_TRUE(rich.plays());
  EXPECT_EQ(rich.core->stream()->name, "rich");
  Stage::expect_same(near, rich, 30);
  EXPECT_EQ(thin.resyncs(), 0U);
  EXPECT_GT(stage.nats.published, 30U);
}

TEST(Relay, QuietFramesTravelOneByOneAsWhatIsMissingIsAskedForByFrames) {
  transport::FakeNats nats(1);
  transport::NatsServerPort server({.session = "default",
                                    .site = "hub",
                                    .client = 0,
                                    .sender = 1,
                                    .clock = [&nats] { return nats.now_ns; }},
                                   nats.connect());
  ASSERT_TRUE(server.open_streams(1));
  transport::DeltaMessage delta;
  delta.epoch = 1000;
  delta.frame = 10;
  ASSERT_TRUE(server.write(delta));
  const auto one = server.counts()->published;
  delta.frame = 15;
  delta.earlier = 4;
  ASSERT_TRUE(server.write(delta));
  EXPECT_EQ(server.counts()->published, one + 5);
  transport::FrameBundle bundle;
  for (delta.frame = 16; delta.frame <= 18; ++delta.frame)
    bundle.add(delta.frame, delta.frame, transport::Bytes(3));
  delta = bundle.take();
  delta.epoch = 1000;
  ASSERT_TRUE(server.write(delta));
  EXPECT_EQ(server.counts()->published, one + 8);
  delta.payload.pop_back();
  EXPECT_FALSE(server.write(delta));
}

// A relay has a client for each stream that it follows, all in one process.
TEST(Relay, AProcessThatLeavesOneStreamIsStillThere) {
  transport::FakeNats nats(1);
  const auto options = [&](const std::string& site, std::uint32_t sender, transport::ClientId client) {
    return transport::NatsPortOptions{
        .session = "default", .site = site, .client = client, .sender = sender, .clock = [&nats] {
          return nats.now_ns;
        }};
  };
  transport::NatsServerPort server(options("hub", 1, 0), nats.connect());
  std::vector<transport::Received<transport::AckMessage>> acks;
  const auto pass = [&] {
    nats.now_ns += 300 * kMillisecond;
    server.take(acks);
  };
  ASSERT_TRUE(server.open_streams(2));
  transport::SessionMessage session;
  session.session = "default";
  session.epoch = 1000;
  ASSERT_TRUE(server.write(session));
  transport::NatsClientPort first(options("far", 2, 7), nats.connect());
  auto second = std::make_unique<transport::NatsClientPort>(options("far", 2, 8), nats.connect());
  for (int i = 0; i < 3; ++i) {
    pass();
    static_cast<void>(first.server_alive());
    static_cast<void>(second->server_alive());
  }
  transport::AckMessage ack;
  ack.client = 7;
  ASSERT_TRUE(first.write(ack));
  ack.client = 8;
  ASSERT_TRUE(second->write(ack));
  pass();
  ASSERT_EQ(acks.size(), 2U);
  EXPECT_EQ(server.counts()->followers, 1U) << "a process";
  EXPECT_TRUE(server.alive(acks[0].from) && server.alive(acks[1].from));
  second.reset();
  pass();
  EXPECT_TRUE(server.alive(acks[0].from));
  EXPECT_FALSE(server.ended(acks[0].from)) << "its account would be forgotten";
  EXPECT_TRUE(server.ended(acks[1].from));
  EXPECT_EQ(server.counts()->followers, 1U);
  { const auto gone = std::make_unique<transport::NatsClientPort>(options("far", 2, 7), nats.connect()); }
  pass();
  EXPECT_TRUE(server.ended(acks[0].from));
  EXPECT_EQ(server.counts()->followers, 0U);
}

TEST(Relay, APayloadAboveTheServersLimitIsCut) {
  Stage stage;
  stage.nats.most_bytes = 200;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(6000);
  ASSERT_TRUE(edge.plays());
  Stage::expect_same(near, edge, 80);
}

// A forged delta makes who takes it join again; it is never passed on, and no wrong state is kept.
TEST(Relay, AForgedDeltaIsNotPassedOn) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  stage.start_far();
  Watcher& near = stage.add_near();
  Watcher& far = stage.add_far();
  stage.run_ms(3000);
  const auto thief = stage.nats.connect();
  transport::nats::Packer packer(99);
  for (int i = 0; i < 5; ++i) {
    transport::DeltaMessage forged;
    forged.epoch = 1000;
    forged.frame = stage.far->relay->host()->frame() + 1;
    forged.hash = 1;
    forged.payload.assign(40, std::byte{0});
    transport::Bytes envelope;
    write_envelope(forged, envelope);
    for (const auto& packet : packer.pack(envelope, 64'000))
      static_cast<void>(thief->publish("tandem.default.delta.0", packet));
    stage.run_ms(500);
  }
  // After several in a row the relay takes its own computer for the culprit, and tries again some time later.
  stage.run_ms(14'000);
  Stage::expect_same(near, far, 60);
  EXPECT_EQ(far.core->statistics().hash_mismatches, 0U);
  const client::Statistics& counted = stage.far->upstream->first().client().core().statistics();
  EXPECT_GT(counted.hash_mismatches + counted.refused_messages, 0U);
  EXPECT_GE(far.frame() + 6, near.frame());
}

TEST(Relay, ASiteThatMayNotPublishDeltasReachesNobody) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  const auto viewer = stage.nats.connect(
      [](const std::string& subject) { return subject.starts_with("tandem.default.from.viewer."); });
  ASSERT_TRUE(viewer->publish("tandem.default.delta.0", transport::Bytes(10)));
  stage.run_ms(1000);
  EXPECT_EQ(edge.resyncs(), 0U);
}

TEST(Relay, AStormOfRequestsIsBounded) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  const auto storm = stage.nats.connect();
  transport::nats::Packer packer(98);
  transport::Bytes hello;
  transport::nats::write(transport::nats::Hello{"storm"}, hello);
  for (const auto& packet : packer.pack(hello, 64'000))
    static_cast<void>(storm->publish("tandem.default.hello", packet));
  stage.run_ms(10);
  transport::Bytes ask;
  transport::nats::write(
      transport::nats::Ask{
          .epoch = 1000, .what = transport::nats::Ask::For::kDeltas, .stream = {}, .first = 1, .count = 60},
      ask);
  for (int i = 0; i < 2000; ++i) {
    for (const auto& packet : packer.pack(ask, 64'000))
      static_cast<void>(storm->publish("tandem.default.from.storm.00000000000000ff", packet));
    stage.run_ms(1);
  }
  const auto counts = *stage.published->counts();
  EXPECT_GT(counts.asks_refused, 1800U);
  EXPECT_LT(counts.repeated, 130U * 60U);
  EXPECT_EQ(edge.resyncs(), 0U);
}

TEST(Relay, NoiseIsCountedAndHarmless) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  const auto noise = stage.nats.connect();
  Dice dice(7);
  for (int i = 0; i < 2000; ++i) {
    transport::Bytes bytes(dice.below(80));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(dice.next());
    if (bytes.size() > 2 && dice.one_in(2)) {
      bytes[0] = std::byte{transport::nats::kRelayVersion};
      bytes[1] = std::byte{0};
    }
    for (const char* subject : {"from.edge.00000000000000aa", "from.edge", "hello", "beat", "delta.0",
                                "inputs", "status", "to.edge.0000000000000bb8"})
      static_cast<void>(noise->publish("tandem.default." + std::string(subject), bytes));
    stage.run_ms(1);
  }
  stage.run_ms(1000);
  EXPECT_TRUE(edge.plays());
  EXPECT_EQ(edge.resyncs(), 0U);
  EXPECT_GT(stage.published->dropped() + stage.edge_port->dropped(), 1000U);
}

TEST(Relay, AnotherVersionIsNamed) {
  Stage stage;
  stage.add_edge();
  const auto other = stage.nats.connect();
  static_cast<void>(
      other->publish("tandem.default.beat", transport::Bytes{std::byte{9}, {}, {}, {}, {}, {}, {}}));
  stage.run_ms(100);
  EXPECT_NE(stage.edge_port->trouble().find("version 9"), std::string::npos) << stage.edge_port->trouble();
}

TEST(Relay, ASecondRelayOfASessionStandsBackAndSaysSo) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  stage.run_ms(3000);
  const auto first = std::move(stage.near);
  stage.start_near();
  for (int i = 0; i < 3000; ++i) {
    stage.run_ms(1);
    first->poll(stage.clocks());
  }
  ASSERT_FALSE(stage.near->lines.empty());
  bool said = false;
  for (const std::string& line : stage.near->lines)
    said = said || line.find("already has a server") != std::string::npos;
  EXPECT_TRUE(said);
  EXPECT_EQ(first->relay->obstacle(), nullptr);
}

}  // namespace
}  // namespace tandem::relay
