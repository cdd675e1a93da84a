// What a site can do to the others, and what its machine can have wrong.

#include <gtest/gtest.h>

#include "sdk/wire/envelope.hpp"
#include "tests/unit/relay/stage.hpp"

namespace tandem::relay {
namespace {

using transport::InputKind;
using transport::Phase;

/// A process of site `storm` that speaks for clients of its own.
class Storm {
 public:
  explicit Storm(Stage& stage) : stage_(stage), bus_(stage.nats.connect()) {
    transport::Bytes hello;
    transport::nats::write(transport::nats::Hello{"storm"}, hello);
    for (const auto& packet : packer_.pack(hello, 64'000))
      static_cast<void>(bus_->publish("tandem.default.hello", packet));
    stage_.run_ms(10);
  }
  template <class M>
  void say(transport::ClientId client, const M& message) {
    transport::Bytes bytes;
    transport::write_envelope(message, bytes);
    for (const auto& packet : packer_.pack(bytes, 64'000))
      static_cast<void>(bus_->publish(transport::nats::from_subject("default", "storm", client), packet));
  }
  void join(transport::ClientId client) {
    transport::AckMessage ack;
    ack.client = client;
    ack.epoch = 1000;
    ack.phase = Phase::kJoining;
    ack.role_wanted = transport::Role::kObserver;
    ack.join_attempt = 1;
    say(client, ack);
  }

 private:
  Stage& stage_;
  std::unique_ptr<transport::FakeNats::Bus> bus_;
  transport::nats::Packer packer_{98};
};

// The relay shares one account at the server among all; a flood must not use up what others need.
TEST(Hostile, AFloodOfInputsOfOneSiteDoesNotSilenceAnother) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  ASSERT_TRUE(edge.plays());
  Storm storm(stage);
  for (transport::ClientId id = 0xa0; id < 0xa8; ++id) storm.join(id);
  stage.run_ms(500);
  const client::Statistics& relay = stage.near->upstream->first().client().core().statistics();
  const std::uint64_t before = relay.inputs_sent;
  std::uint64_t number = 0;
  for (int ms = 0; ms < 4000; ++ms) {
    if (ms == 2000) {
      ASSERT_TRUE(edge.core->send(InputKind::kGravity, {2, -9, 0}, {}, stage.clocks()));
    }
    for (transport::ClientId id = 0xa0; id < 0xa8; ++id) {
      transport::InputMessage input;
      input.client = id;
      input.epoch = 1000;
      input.number = ++number;
      input.kind = static_cast<std::uint32_t>(ms % 2 == 0 ? InputKind::kGravity : InputKind::kPush);
      input.values = ms % 2 == 0 ? std::vector<double>{0, -9, 1} : std::vector<double>{0, 0, 0, 1, 1, 0, 0};
      storm.say(id, input);
    }
    stage.run_ms(1);
  }
  stage.run_ms(1000);
  EXPECT_LT(relay.inputs_sent - before, 5 * 60U) << "inputs reach the server at a bounded rate";
  ASSERT_EQ(edge.outcomes.size(), 1U);
  EXPECT_EQ(edge.outcomes[0].kind, client::InputOutcome::Kind::kActed);
  EXPECT_EQ(edge.resyncs() + near.resyncs(), 0U);
  EXPECT_GE(edge.frame() + 6, near.frame());
}

TEST(Hostile, AStormOfJoinersCostsAFewSnapshotsAndNobodyElseAFrame) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  ASSERT_TRUE(edge.plays());
  Storm storm(stage);
  const std::uint64_t before = stage.near->relay->host()->totals().snapshots;
  for (int ms = 0; ms < 3000; ++ms) {
    storm.join(0x10'0000 + static_cast<transport::ClientId>(ms));
    stage.run_ms(1);
  }
  const std::uint64_t made = stage.near->relay->host()->totals().snapshots - before;
  std::printf("%llu snapshots for 3,000 joiners in 3 s\n", static_cast<unsigned long long>(made));
  EXPECT_LE(made, 100U) << "at most one a frame, whoever asks";
  EXPECT_EQ(edge.resyncs() + near.resyncs(), 0U);
  EXPECT_GE(edge.frame() + 6, near.frame());
  // Those who ask can be more than may play; who played goes on playing.
  stage.run_ms(2000);
  EXPECT_GE(edge.frame() + 6, near.frame());
}

/// 1,100 Hellos of sites that do not exist.
void make_up_sites(Stage& stage, transport::FakeNats::Bus& bus, std::uint64_t proof = 0) {
  transport::nats::Packer packer(98);
  for (int i = 0; i < 1100; ++i) {
    transport::Bytes hello;
    transport::nats::write(transport::nats::Hello{"made-up" + std::to_string(i), proof}, hello);
    for (const auto& packet : packer.pack(hello, 64'000))
      static_cast<void>(bus.publish("tandem.default.hello", packet));
    if (i % 10 == 0) stage.run_ms(1);
  }
  stage.run_ms(10);
}

TEST(Hostile, NamesOfSitesThatAreMadeUpCostTheRelayNoSubscription) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  const auto storm = stage.nats.connect(Stage::only("storm"));
  make_up_sites(stage, *storm);
  make_up_sites(stage, *storm, transport::nats::site_proof({1, 1}, "storm"));
  EXPECT_TRUE(stage.first_bus->connected()) << "the NATS server cuts who has too many";
  EXPECT_LT(stage.first_bus->subjects().size(), 8U);
  Watcher& leaf = stage.add_leaf("late");
  stage.run_ms(3000);
  EXPECT_TRUE(edge.plays() && leaf.plays());
  EXPECT_GE(leaf.frame() + 6, edge.frame());
  EXPECT_EQ(edge.resyncs() + leaf.resyncs(), 0U);
}

TEST(Hostile, TheProofOfOneSiteIsNoneOfAnother) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  stage.run_ms(1000);
  const auto storm = stage.nats.connect(Stage::only("storm"));
  ASSERT_TRUE(storm->subscribe("tandem.default.to.storm.hello"));
  const auto hello = [&](const std::string& site, std::uint64_t proof) {
    transport::nats::Packer packer(98);
    transport::Bytes bytes;
    transport::nats::write(transport::nats::Hello{site, proof}, bytes);
    for (const auto& packet : packer.pack(bytes, 64'000))
      static_cast<void>(storm->publish("tandem.default.hello", packet));
    stage.run_ms(5);
  };
  hello("storm", 0);
  std::vector<transport::NatsArrival> arrivals;
  storm->take(arrivals);
  ASSERT_EQ(arrivals.size(), 1U);
  transport::nats::Unpacker unpacker;
  const auto unpacked = unpacker.take(arrivals[0].subject, arrivals[0].bytes);
  ASSERT_TRUE(unpacked);
  const auto proof = transport::nats::read_proof(unpacked->message);
  ASSERT_TRUE(proof);
  hello("edge", *proof);
  EXPECT_FALSE(stage.first_bus->subjects().contains("tandem.default.from.edge.>"));
  hello("storm", *proof);
  EXPECT_TRUE(stage.first_bus->subjects().contains("tandem.default.from.storm.>"));
  stage.run_ms(11'500);
  EXPECT_FALSE(stage.first_bus->subjects().contains("tandem.default.from.storm.>"))
      << "a site that says nothing for 10 s is not listened to";
}

TEST(Hostile, ASiteBehindALeafNodeIsHeardAgainAfterItsLinkWasCut) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& leaf = stage.add_leaf("north");
  transport::FakeNats::Bus& bus = *stage.edge_bus;
  stage.run_ms(15'000);
  ASSERT_TRUE(leaf.plays());
  EXPECT_TRUE(stage.first_bus->subjects().contains("tandem.default.from.north.>"));
  bus.cut = true;
  stage.run_ms(20'000);
  EXPECT_FALSE(stage.first_bus->subjects().contains("tandem.default.from.north.>"));
  bus.cut = false;
  stage.run_ms(4000);
  EXPECT_GE(leaf.frame() + 6, near.frame());
  EXPECT_EQ(leaf.resyncs(), 0U);
}

// As many clients may play as a relay has places for; a site that takes all it can get leaves some.
TEST(Hostile, ASiteThatMakesUpClientsKeepsNobodyElseOut) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  stage.run_ms(1000);
  Storm storm(stage);
  for (int second = 0; second < 3; ++second) {
    for (transport::ClientId id = 0x10'0000; id < 0x10'0000 + 5000; ++id) storm.join(id);
    stage.run_ms(1000);
  }
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  EXPECT_TRUE(edge.plays());
  EXPECT_GT(stage.published->counts()->turned_away, 0U);
}

/// Deltas of `count` frames from `first` on that no server made, by somebody who may publish.
void forge(transport::FakeNats::Bus& bus, Frame first, Frame count, std::uint64_t last_input = 0) {
  transport::nats::Packer packer(99);
  for (Frame frame = first; frame < first + count; ++frame) {
    transport::DeltaMessage forged;
    forged.epoch = 1000;
    forged.frame = frame;
    forged.last_input = last_input;
    forged.hash = 1;
    forged.payload.assign(40, std::byte{0});
    transport::Bytes envelope;
    write_envelope(forged, envelope);
    for (const auto& packet : packer.pack(envelope, 64'000))
      static_cast<void>(bus.publish("tandem.default.delta.0", packet));
  }
}

TEST(Hostile, WhoTookForgedDeltasIsBackSoonAfterTheLastOne) {
  for (const std::int64_t flood_ms : {50, 3000, 20'000}) {
    Stage stage;
    stage.start_server();
    stage.start_near();
    Watcher& near = stage.add_near();
    Watcher& edge = stage.add_edge();
    stage.run_ms(3000);
    ASSERT_TRUE(edge.plays());
    const auto thief = stage.nats.connect();
    for (std::int64_t ms = 0; ms < flood_ms; ms += 10) {
      forge(*thief, near.frame() + 1, 50);
      forge(*thief, near.frame() + 1000, 5);
      stage.run_ms(10);
    }
    const std::int64_t ended_ns = stage.now_ns;
    while (edge.frame() + 6 < near.frame() && stage.now_ns < ended_ns + 60 * kSecond) stage.run_ms(100);
    std::printf("back %.1f s after %.1f s of forged deltas\n",
                static_cast<double>(stage.now_ns - ended_ns) * 1e-9, static_cast<double>(flood_ms) * 1e-3);
    EXPECT_LE(stage.now_ns - ended_ns, 7 * kSecond);
    stage.run_ms(3000);
    EXPECT_GE(edge.frame() + 6, near.frame()) << "and stays";
    Stage::expect_same(near, edge, 60);
  }
}

TEST(Hostile, AForgedDeltaThatCountsInputsThatNobodySentHoldsNothingUp) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  Watcher& edge = stage.add_edge();
  stage.run_ms(3000);
  const auto thief = stage.nats.connect();
  forge(*thief, near.frame() + 1, 20, UINT64_MAX / 2);
  stage.run_ms(5000);
  EXPECT_GE(edge.frame() + 6, near.frame());
}

TEST(Hostile, AForgedDeltaOfAFrameFarAwayKeepsNobodyOut) {
  Stage stage;
  stage.start_server();
  stage.start_near();
  Watcher& near = stage.add_near();
  stage.run_ms(3000);
  Watcher& edge = stage.add_edge();
  const auto thief = stage.nats.connect();
  for (int ms = 0; ms < 500; ++ms) {
    forge(*thief, 1'000'000'000, 1);
    stage.run_ms(1);
  }
  stage.run_ms(10'000);
  EXPECT_TRUE(edge.plays());
  EXPECT_GE(edge.frame() + 6, near.frame());
}

TEST(Hostile, ClocksThatDifferByAMinuteHurtNobody) {
  for (const std::int64_t skew_ns : {60 * kSecond, -60 * kSecond}) {
    Stage stage(11);
    stage.far_wall_skew_ns = skew_ns;
    stage.start_server();
    stage.start_near();
    stage.start_far();
    Watcher& near = stage.add_near();
    Watcher& far = stage.add_far();
    stage.run_ms(4000);
    ASSERT_TRUE(far.plays());
    ASSERT_TRUE(far.core->send(InputKind::kGravity, {1, -9, 0}, {}, stage.clocks()));
    stage.run_ms(4000);
    EXPECT_EQ(far.resyncs(), 0U);
    EXPECT_GE(far.frame() + 6, near.frame());
    ASSERT_EQ(far.outcomes.size(), 1U);
    EXPECT_EQ(far.outcomes[0].kind, client::InputOutcome::Kind::kActed);
    Stage::expect_same(near, far, 150);
  }
}

}  // namespace
}  // namespace tandem::relay
