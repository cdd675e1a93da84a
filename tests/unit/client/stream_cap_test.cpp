// A client with a cap plays the stream of the smallest error that is within it, or says why it plays none.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sdk/client/session/stream_choice.hpp"
#include "sdk/wire/units.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::client::of_stream_cap {
namespace {

constexpr double kPeriodNs = 33'333'333;

StreamOffer offer(std::uint32_t id, std::string name, double threshold, std::uint32_t cap_kbit_s) {
  return {.index = id,
          .id = {id, 0},
          .name = std::move(name),
          .is_ballistic = true,
          .threshold = threshold,
          .per_body_ns = 1,
          .announced_ns = 1000,
          .cap_kbit_s = cap_kbit_s,
          .first_threshold = threshold};
}

/// Three of one threshold with caps, and two without.
std::vector<StreamOffer> usual() {
  return {offer(0, "open", 1, 0), offer(1, "wide", 1, 1000), offer(2, "thin", 1, 64), offer(3, "hair", 1, 32),
          offer(4, "coarse", 8, 0)};
}

transport::ServerStatusMessage takes(std::uint32_t stream, double wire_kbit_s, double threshold = 0) {
  transport::ServerStatusMessage status;
  status.stream = stream;
  status.wire_mbit_per_s = wire_kbit_s * 1000 / kBitsPerMbit;
  status.mbit_per_s = status.wire_mbit_per_s / 2;
  status.threshold = threshold;
  status.observers = 1;
  return status;
}

class Watched {
 public:
  explicit Watched(std::uint32_t cap_kbit_s, const std::string& prefer = "auto",
                   std::vector<StreamOffer> offers = usual())
      : chooser(std::move(offers), read_preference(prefer), kPeriodNs, std::nullopt, cap_kbit_s) {
    static_cast<void>(chooser.reconsider({.now_ns = now_ns, .wire_bytes = wire_bytes}));
  }
  /// What is played takes so much. Counts the changes.
  int pass(int seconds, double kbit_s) {
    int changes = 0;
    for (int i = 0; i < seconds; ++i) {
      now_ns += kSecond;
      wire_bytes += static_cast<std::uint64_t>(kbit_s * 125);
      for (int frame = 0; frame < 30; ++frame) chooser.on_frame(1000);
      changes += chooser.reconsider({.now_ns = now_ns, .wire_bytes = wire_bytes}) ? 1 : 0;
    }
    return changes;
  }
  [[nodiscard]] const std::string& name() const { return chooser.chosen().name; }

  std::int64_t now_ns = 1000 * kSecond;
  std::uint64_t wire_bytes = 1'000'000;
  StreamChooser chooser;
};

TEST(StreamCap, TheSmallestErrorWithinTheCapIsTaken) {
  EXPECT_EQ(Watched(2000).name(), "wide") << "what the one without a cap takes is not known";
  EXPECT_EQ(Watched(999).name(), "thin");
  EXPECT_EQ(Watched(64).name(), "thin");
  EXPECT_EQ(Watched(63).name(), "hair");
  EXPECT_EQ(Watched(63).chooser.needed_kbit_s(), std::nullopt);
  EXPECT_EQ(Watched(63, "computing").name(), "hair") << "whatever is preferred";
}

TEST(StreamCap, WithoutACapNothingIsLeftOut) {
  const Watched any(0);
  EXPECT_EQ(any.chooser.needed_kbit_s(), std::nullopt);
  EXPECT_EQ(any.chooser.reason().find("cap"), std::string::npos);
}

TEST(StreamCap, AStreamWithoutACapIsTakenIfTheServerSaysThatItTakesLess) {
  Watched watched(64);
  EXPECT_TRUE(watched.chooser.wants_status());
  watched.chooser.on_status(takes(0, 148));
  watched.chooser.on_status(takes(4, 60));
  EXPECT_FALSE(watched.chooser.wants_status());
  watched.chooser.choose_anew();
  EXPECT_EQ(watched.name(), "thin") << "60 kbit/s would be within, but of eight times the error";
  watched.chooser.on_status(takes(2, 64, 20));
  watched.chooser.choose_anew();
  EXPECT_EQ(watched.name(), "coarse") << "the cap costs the other one more";
  watched.chooser.on_status(takes(0, 63));
  watched.chooser.choose_anew();
  EXPECT_EQ(watched.name(), "open");
}

TEST(StreamCap, WhereNothingFitsTheSmallestThatWouldIsTold) {
  Watched watched(20);
  EXPECT_EQ(watched.chooser.needed_kbit_s(), 32U);
  watched.chooser.on_status(takes(4, 25.5));
  watched.chooser.choose_anew();
  EXPECT_EQ(watched.chooser.needed_kbit_s(), 26U);
  watched.chooser.on_status(takes(4, 19));
  watched.chooser.choose_anew();
  EXPECT_EQ(watched.chooser.needed_kbit_s(), std::nullopt);
  EXPECT_EQ(watched.name(), "coarse");
}

TEST(StreamCap, ANamedStreamAboveTheCapIsNotReplaced) {
  EXPECT_EQ(Watched(100, "wide").chooser.needed_kbit_s(), 1000U);
  EXPECT_EQ(Watched(100, "thin").name(), "thin");
  EXPECT_EQ(Watched(100, "open").chooser.needed_kbit_s(), 0U) << "nothing is known of it";
}

TEST(StreamCap, OfTwoWithTheSameCapTheOneThatNobodyTriedIsNoReasonToChange) {
  auto rich = offer(1, "rich", 1, 64);
  rich.is_ballistic = false;
  rich.announced_ns = 5000;
  Watched watched(64, "auto", {offer(0, "thin", 1, 64), rich});
  EXPECT_EQ(watched.name(), "rich") << "the dearer step is offered because it saves bits";
  watched.chooser.on_status(takes(0, 60, 1));
  watched.chooser.on_status(takes(1, 60, 30));
  EXPECT_EQ(watched.pass(60, 60), 0);
  watched.chooser.choose_anew();
  EXPECT_EQ(watched.name(), "rich");
  watched.chooser.on_status(takes(0, 60, 10));
  EXPECT_EQ(watched.pass(60, 60), 1) << "somebody else plays it, of a third of the error";
}

TEST(StreamCap, AStreamThatTakesMoreIsLeftAfterSecondsForACheaperOne) {
  Watched watched(64);
  EXPECT_EQ(watched.pass(60, 66), 0) << "within 5 %";
  EXPECT_EQ(watched.pass(4, 80), 0) << "a burst";
  EXPECT_EQ(watched.pass(1, 60), 0);
  EXPECT_EQ(watched.pass(4, 80), 0);
  EXPECT_EQ(watched.pass(1, 80), 1);
  EXPECT_EQ(watched.name(), "hair");
  EXPECT_NE(watched.chooser.reason().find("thin takes 80 of 64 kbit/s"), std::string::npos)
      << watched.chooser.reason();
  EXPECT_EQ(watched.chooser.needed_kbit_s(), std::nullopt);
  EXPECT_EQ(watched.pass(30, 30), 0) << "and not taken again at once";
}

TEST(StreamCap, WithoutACheaperOneItIsRefusedWithWhatItTook) {
  Watched watched(64, "auto", {offer(0, "open", 1, 64)});
  EXPECT_EQ(watched.pass(6, 99), 0);
  EXPECT_EQ(watched.chooser.needed_kbit_s(), 99U);
}

TEST(StreamCap, TwoChangesAreAtLeastTwoSecondsApart) {
  Watched watched(1000);
  ASSERT_EQ(watched.name(), "wide");
  EXPECT_EQ(watched.pass(6, 2000), 1);
  for (int frame = 0; frame < 30; ++frame) watched.chooser.on_frame(1'000'000'000);  // hopeless
  EXPECT_EQ(watched.pass(1, 2000), 0);
}

TEST(StreamCap, TwoStreamsOfOneLayoutAndTwoCapsAreTwoChoices) {
  transport::SessionMessage session = FakeServer().session;
  session.streams.push_back(session.streams[0]);
  session.streams[1].id = {1, 0};
  session.streams[1].delay_ms = 200;
  EXPECT_TRUE(list_offers(session, {0, 1}, 0)[1].suits_others);
  session.streams[1].cap_kbit_s = 64;
  const auto offers = list_offers(session, {0, 1}, 0);
  EXPECT_FALSE(offers[1].suits_others);
  EXPECT_EQ(offers[1].cap_kbit_s, 64U);
}

/// A whole client.
class ClientCap : public ClientTest {
 protected:
  void told(double wire_kbit_s) {
    auto status = takes(0, wire_kbit_s);
    status.epoch = server.session.epoch;
    status.frame_rate_hz = 30;
    port.server_statuses.push_back(from_server(status));
  }
  void search(std::uint32_t cap, bool gateway = false) {
    cap_kbit_s = cap;
    gateway_caps = gateway;
    start();
    port.sessions.push_back(from_server(server.session));
    poll();
  }
  void wait_s(int seconds) {
    for (int i = 0; i < 20 * seconds; ++i) poll(50 * kMs);
  }
};

TEST_F(ClientCap, IsToldToTheServerWithWhatItAcknowledges) {
  server.session.streams[0].cap_kbit_s = 64;
  search(64);
  poll();
  ASSERT_FALSE(port.acks.empty());
  EXPECT_EQ(port.acks.back().cap_kbit_s, 64U);
}

TEST_F(ClientCap, BelowTheCapsOfAllStreamsItIsRefusedWithBothNumbersBeforeItJoins) {
  server.session.streams[0].cap_kbit_s = 64;
  search(63);
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  const std::string reason = core->status().reason;
  EXPECT_NE(reason.find("it needs 64 kbit/s"), std::string::npos) << reason;
  EXPECT_NE(reason.find("the cap is 63"), std::string::npos) << reason;
  EXPECT_TRUE(port.acks.empty() || port.acks.back().join_attempt == 0);
}

TEST_F(ClientCap, AwaitsWhatAStreamWithoutACapTakes) {
  search(100);
  wait_s(3);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  told(90);
  wait_s(1);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  ASSERT_FALSE(port.acks.empty());
  EXPECT_GT(port.acks.back().join_attempt, 0U) << "it asks for a snapshot";
}

TEST_F(ClientCap, WhereAStreamWithoutACapTakesMoreItIsRefused) {
  search(100);
  told(148);
  wait_s(2);
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  EXPECT_NE(core->status().reason.find("it needs 148 kbit/s"), std::string::npos) << core->status().reason;
}

TEST_F(ClientCap, WhereNothingIsEverToldItIsRefused) {
  search(100);
  wait_s(10);
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
}

TEST_F(ClientCap, OverAGatewayItDoesNotChooseByIt) {
  search(20, true);
  wait_s(1);
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  ASSERT_FALSE(port.acks.empty());
  EXPECT_EQ(port.acks.back().cap_kbit_s, 20U);
}

TEST_F(ClientCap, TheServersRefusalIsToldWithBothNumbers) {
  server.session.streams[0].cap_kbit_s = 64;
  search(64);
  poll();
  transport::ReplyMessage reply;
  reply.client = kClient;
  reply.epoch = server.session.epoch;
  reply.reason = static_cast<std::uint32_t>(transport::Reason::kCap);
  reply.needed_kbit_s = 128;
  port.replies.push_back(from_server(reply));
  poll();
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  EXPECT_NE(core->status().reason.find("it needs 128 kbit/s on the network, and the cap is 64"),
            std::string::npos)
      << core->status().reason;
}

}  // namespace
}  // namespace tandem::client::of_stream_cap
