// What a site can do to the others, and what its machine can have wrong.

#include <gtest/gtest.h>

#include "sdk/transport/envelope.hpp"
#include "tests/unit/relay/stage.hpp"

namespace tandem::relay {
namespace {

using transport::InputKind;
using transport::Phase;

client::Now now_of(const Stage& stage) { return {stage.now_ns, stage.now_ns + 1'700'000'000 * kSecond}; }

/// A process of site `storm` that speaks for clients of its own.
class Storm {
 public:
  explicit Storm(Stage& stage) : stage_(stage), bus_(stage.nats.connect()) {
    transport::Bytes hello;
    transport::nats::write_hello("storm", hello);
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
      ASSERT_TRUE(edge.core->send(InputKind::kGravity, {2, -9, 0}, {}, now_of(stage)));
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
    ASSERT_TRUE(far.core->send(InputKind::kGravity, {1, -9, 0}, {}, now_of(stage)));
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
