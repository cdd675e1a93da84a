// A participant sends arbitrary messages to the server, and no other client may notice.
#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "tests/fault/host/stage.hpp"

namespace tandem::host {
namespace {

// Mostly plausible fields, each now and then something else.
class Liar {
 public:
  Liar(Stage& stage, Server& server, std::uint64_t seed)
      : server_(&server), dice_(seed), port_(must(stage.network.make_client("default"))) {}

  void speak() {
    if (dice_.one_in(2)) {
      transport::AckMessage ack;
      ack.client = some_client();
      ack.epoch = some_epoch();
      ack.protocol_version =
          dice_.one_in(10) ? static_cast<std::uint32_t>(dice_.next()) : transport::kProtocolVersion;
      ack.phase = static_cast<transport::Phase>(dice_.below(dice_.one_in(10) ? 5 : 2));
      ack.applied = some_frame();
      ack.simulated = some_frame();
      ack.role_wanted = transport::Role::kObserver;  // another test covers delays by participants
      ack.clock_ns = static_cast<std::int64_t>(dice_.next());
      ack.join_attempt = static_cast<std::uint32_t>(dice_.below(4));
      static_cast<void>(port_->write(ack));
      return;
    }
    transport::InputMessage input;
    input.client = some_client();
    input.epoch = some_epoch();
    input.number = dice_.one_in(4) ? dice_.next() : dice_.below(50);
    input.client_frame = some_frame();
    input.kind = dice_.one_in(4) ? static_cast<std::uint32_t>(dice_.next())
                                 : 1 + static_cast<std::uint32_t>(dice_.below(2));
    input.values.resize(dice_.one_in(4) ? dice_.below(16) : (input.kind == 1 ? 3 : 7));
    for (double& value : input.values) value = some_value();
    input.bytes.resize(dice_.one_in(4) ? dice_.below(1024) : 0);
    static_cast<void>(port_->write(input));
  }

 private:
  // Its own ids, those of the honest clients, and nobody's.
  transport::ClientId some_client() {
    switch (dice_.below(4)) {
      case 0:
        return 100 + dice_.below(3);
      case 1:
        return dice_.below(3);
      default:
        return 5000 + dice_.below(400);
    }
  }
  Epoch some_epoch() { return dice_.one_in(6) ? dice_.next() : server_->host->session().epoch; }
  Frame some_frame() {
    return dice_.one_in(4) ? dice_.next()
                           : server_->host->frame() - std::min<Frame>(server_->host->frame(), dice_.below(5));
  }
  double some_value() {
    switch (dice_.below(6)) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return -std::numeric_limits<double>::infinity();
      case 2:
        return std::bit_cast<double>(dice_.next());
      default:
        return static_cast<double>(dice_.below(2000)) / 10 - 100;
    }
  }

  Server* server_;
  Dice dice_;
  std::unique_ptr<transport::ClientPort> port_;
};

TEST(Hostile, AParticipantThatSaysAnythingIsCountedAndNobodyElseNotices) {
  for_seeds(12, [](std::uint64_t seed) {
    Stage stage(seed, {.delay_ns = 2'000'000, .jitter_ns = 2'000'000});
    Server& server = stage.add_server(1'000'000);
    for (int i = 0; i < 3; ++i) stage.add_client();
    stage.run_ms(3000);
    ASSERT_EQ(server.host->participants(), 3U);
    std::vector<std::unique_ptr<Liar>> liars;
    for (std::uint64_t i = 0; i < 2; ++i)
      liars.push_back(std::make_unique<Liar>(stage, server, seed * 100 + i));
    const Frame before = server.host->frame();
    stage.on_ms = [&] {
      for (auto& liar : liars) liar->speak();
    };
    stage.run_ms(5000);
    EXPECT_NEAR(static_cast<double>(server.host->frame() - before), 150, 5);
    EXPECT_GE(server.host->participants(), 3U);
    EXPECT_EQ(server.host->totals().demotions, 0U);
    EXPECT_GT(server.host->totals().refused_messages, 100U);
    EXPECT_GT(server.host->totals().refused_inputs, 100U);
    EXPECT_LE(server.host->outbox().high_water(), 1100U);
    for (const auto& client : stage.clients) {
      EXPECT_TRUE(Stage::plays(*client, *server.host));
      EXPECT_EQ(client->core->statistics().resyncs, 0U);
      EXPECT_EQ(client->core->statistics().hash_mismatches, 0U);
      EXPECT_EQ(client->core->statistics().refused_messages, 0U);
    }
    // And an honest input still gets through.
    const client::Now now{stage.now_ns, stage.wall_ns()};
    ASSERT_TRUE(stage.clients[0]->core->send(transport::InputKind::kGravity, {0, -1, 0}, {}, now));
    stage.run_ms(500);
    EXPECT_EQ(stage.clients[0]->core->statistics().inputs_acted, 1U);
  });
}

}  // namespace
}  // namespace tandem::host
