#include "sdk/web/module/web_client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "sdk/core/lattice/hash.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::web {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kMs = client::kMs;

/// A viewer, and a gateway that is the test.
class WebClientTest : public ::testing::Test {
 protected:
  WebClientTest() : viewer({.id = 77, .role = ClientRole::kParticipant, .lead = 1, .log = {}}) {}

  template <class M>
  void give(const M& message) {
    transport::Bytes bytes;
    transport::write_envelope(message, bytes);
    ASSERT_TRUE(viewer.port().receive(bytes));
  }
  client::Now now() const { return {now_ns, now_ns + 500 * kMs}; }
  void poll(std::int64_t later_ns = kMs) {
    now_ns += later_ns;
    viewer.poll(now());
    while (const auto message = viewer.port().next_message())
      sent.push_back(*transport::read_viewer_envelope(*message));
  }
  void frame() {
    give(server.advance(now_ns));
    poll(client::kFrameNs);
  }
  void join() {
    viewer.port().connected();
    give(server.session);
    poll();
    ASSERT_FALSE(sent.empty());
    give(server.advance(now_ns));
    give(server.snapshot());
    poll();
    ASSERT_EQ(viewer.core().phase(), ClientPhase::kPlaying);
  }

  client::FakeServer server;
  WebClient viewer;
  std::vector<transport::ViewerMessage> sent;
  std::int64_t now_ns = 1'000'000'000'000;
};

TEST_F(WebClientTest, PlaysWhateverSessionTheGatewayHas) {
  server.session.session = "anything";
  join();
  const auto& ack = std::get<transport::AckMessage>(sent[0]);
  EXPECT_EQ(ack.client, 77U);
  EXPECT_EQ(ack.phase, transport::Phase::kJoining);
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(viewer.core().timeline()->hash(), server.hashes[6]);
}

TEST_F(WebClientTest, TellsEachFrameOnceWithItsHash) {
  join();
  EXPECT_EQ(viewer.take_events(), R"([{"type":"session","epoch":1000}])");
  frame();
  const std::string events = viewer.take_events();
  EXPECT_THAT(events,
              HasSubstr(R"([{"type":"applied","epoch":1000,"frame":2,"hash":")" + to_hex(server.hashes[2])));
  EXPECT_EQ(viewer.take_events(), "");
  frame();
  frame();
  EXPECT_THAT(viewer.take_events(), HasSubstr(R"(},{"type":"applied","epoch":1000,"frame":4)"));
}

TEST_F(WebClientTest, TellsKeysAndEventsOfTheSession) {
  server = client::FakeServer(1000, 40, 1, {}, {.keys = true, .events = true});
  join();
  static_cast<void>(viewer.take_events());
  std::vector<std::byte> news(64);
  ByteWriter out(news);
  const std::array<std::byte, 2> bytes{std::byte{0x0A}, std::byte{0xFF}};
  put_section(SectionType::kKeys, out, [&](ByteWriter& body) { write_key_change({"score", bytes}, body); });
  put_section(SectionType::kEvents, out, [&](ByteWriter& body) {
    write_event({7, WorldEvent::Body{3, 1}, bytes}, body);
  });
  news.resize(out.size());
  server.news = news;
  frame();
  const std::string events = viewer.take_events();
  EXPECT_THAT(events, HasSubstr(R"({"type":"key","epoch":1000,"frame":2,"key":"score","value":"0aff"})"));
  EXPECT_THAT(events, HasSubstr(R"({"type":"happened","epoch":1000,"frame":2,"number":1,"kind":7,)"
                                R"("body":{"slot":3,"reuse":1},"data":"0aff"})"));
}

TEST_F(WebClientTest, TellsOfDataOfBodiesThatThereAreNone) {
  join();
  EXPECT_EQ(viewer.data_fields(), "[]");
  EXPECT_TRUE(viewer.data().empty());
}

TEST_F(WebClientTest, EventsThatNobodyTakesAreBounded) {
  join();
  for (int i = 0; i < 20'000; ++i) frame();
  EXPECT_LT(viewer.take_events().size(), 1'100'000U);
  frame();
  EXPECT_THAT(viewer.take_events(), HasSubstr(R"("frame":20002)"));
}

TEST_F(WebClientTest, MarksWhatTheLastDeltaCorrected) {
  join();
  frame();
  const auto corrected = viewer.core().timeline()->corrected();
  ASSERT_FALSE(corrected.empty());
  std::vector<Slot> marked;
  for (Slot slot = 0; slot < viewer.corrected().size(); ++slot) {
    if (viewer.corrected()[slot] != 0) marked.push_back(slot);
  }
  EXPECT_EQ(marked, std::vector<Slot>(corrected.begin(), corrected.end()));
  EXPECT_THAT(viewer.status(), HasSubstr("\"corrected\":" + std::to_string(marked.size())));
}

TEST_F(WebClientTest, RemembersTheFrameOfEachBodysLastCorrection) {
  join();
  std::vector<std::uint32_t> expected(server.session.capacity);
  for (std::uint32_t i = 2; i < 8; ++i) {
    frame();
    for (const Slot slot : viewer.core().timeline()->corrected()) expected[slot] = i;
  }
  EXPECT_EQ(expected, std::vector<std::uint32_t>(viewer.corrected_in().begin(), viewer.corrected_in().end()));
  EXPECT_NE(expected, std::vector<std::uint32_t>(server.session.capacity));
}

TEST_F(WebClientTest, TellsTheGravityInForceInSceneUnits) {
  EXPECT_THAT(viewer.status(), HasSubstr(R"("gravity":[0,0,0])"));
  join();
  give(server.schedule(-300));
  for (int i = 0; i < 4; ++i) frame();
  // 300 / 64 lattice units of 0.001 a frame^2, at 30 frames a second.
  EXPECT_THAT(viewer.status(), HasSubstr(R"("gravity":[0,-4.21875,0])"));
}

TEST_F(WebClientTest, TellsHowFarBodiesDriftWithoutCorrections) {
  join();
  EXPECT_THAT(viewer.status(), HasSubstr(R"("uncorrected":null)"));
  viewer.show_uncorrected(true);
  server.teleport(3);
  frame();
  EXPECT_THAT(viewer.status(), HasSubstr(R"("uncorrected":{"frames":1,"bodies":40,"meanDrift":)"));
  viewer.show_uncorrected(false);
  EXPECT_THAT(viewer.status(), HasSubstr(R"("uncorrected":null)"));
}

TEST_F(WebClientTest, InputsLeaveAndTheirOutcomesAreTold) {
  join();
  frame();
  static_cast<void>(viewer.take_events());
  const auto number = viewer.send(transport::InputKind::kGravity, {0, -1, 0}, {}, now());
  ASSERT_TRUE(number);
  poll();
  transport::ReplyMessage reply;
  reply.client = 77;
  reply.epoch = 1000;
  reply.role = transport::Role::kParticipant;
  reply.phase = transport::Phase::kPlaying;
  reply.highest_input = *number;
  reply.entries = {{*number, 3, 0}};
  give(reply);
  frame();
  EXPECT_THAT(viewer.take_events(),
              HasSubstr(R"({"type":"outcome","number":1,"kind":"acted","frame":3,"reason":"")"));
  const auto number_refused = viewer.send(transport::InputKind::kGravity, {0, -1, 0}, {}, now());
  reply.highest_input = *number_refused;
  reply.entries = {{*number_refused, 0, static_cast<std::uint32_t>(transport::Reason::kRateLimited)}};
  give(reply);
  poll();
  EXPECT_THAT(viewer.take_events(),
              HasSubstr(R"("kind":"refused","frame":0,"reason":"input refused: there were too many)"));
}

TEST_F(WebClientTest, LagIsByTheServersClock) {
  join();
  // Stamped 20 ms before they are applied, by a clock that is a day ahead, and echoed 20 ms on either way.
  constexpr std::int64_t kAheadNs = 86'400'000 * kMs;
  transport::ReplyMessage reply;
  reply.client = 77;
  reply.epoch = 1000;
  for (int i = 0; i < 60; ++i) {
    reply.client_clock_ns = now_ns - 40 * kMs;
    reply.server_time_ns = now_ns - 20 * kMs + kAheadNs;
    give(reply);
    give(server.advance(now_ns + client::kFrameNs - 20 * kMs + kAheadNs));
    poll(client::kFrameNs);
  }
  EXPECT_THAT(viewer.status(), HasSubstr("\"lagMs\":20,"));
}

TEST_F(WebClientTest, OverAnotherConnectionItGoesOnWithWhatItHolds) {
  join();
  frame();
  const std::uint64_t held = server.frame();
  std::vector<transport::DeltaMessage> missed;
  viewer.port().disconnected();
  for (int i = 0; i < 300; ++i) missed.push_back(server.advance(now_ns += client::kFrameNs));
  poll();
  EXPECT_THAT(viewer.status(), HasSubstr(R"("serverAlive":false)"));
  sent.clear();
  viewer.port().connected();
  poll();
  EXPECT_TRUE(sent.empty()) << "nothing is known of this gateway yet";
  give(server.session);
  poll();
  ASSERT_FALSE(sent.empty());
  const auto& ack = std::get<transport::AckMessage>(sent[0]);
  EXPECT_EQ(ack.phase, transport::Phase::kPlaying);
  EXPECT_EQ(ack.epoch, server.session.epoch);
  EXPECT_EQ(ack.applied, held);
  for (const auto& delta : missed) give(delta);
  for (int i = 0; i < 10; ++i) poll();
  EXPECT_EQ(viewer.core().timeline()->applied(), server.frame());
  EXPECT_EQ(viewer.core().timeline()->hash(), server.hashes[server.frame()]);
  EXPECT_EQ(viewer.core().statistics().resyncs, 0U);
  EXPECT_EQ(viewer.core().statistics().epochs, 1U);
  EXPECT_EQ(viewer.core().join_attempt(), 1U);
}

TEST_F(WebClientTest, AGatewayThatLacksWhatItMissedIsJoined) {
  join();
  frame();
  viewer.port().disconnected();
  for (int i = 0; i < 30; ++i) server.advance(now_ns += client::kFrameNs);
  viewer.port().connected();
  give(server.session);
  poll();
  sent.clear();
  frame();  // a gap
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(std::get<transport::AckMessage>(sent.back()).phase, transport::Phase::kJoining);
  give(server.snapshot());
  poll();
  EXPECT_EQ(viewer.core().timeline()->hash(), server.hashes[server.frame()]);
  EXPECT_EQ(viewer.core().statistics().resyncs, 1U);
}

TEST_F(WebClientTest, InputsThatAnotherConnectionTookAreUnknown) {
  join();
  frame();
  ASSERT_FALSE(viewer.take_events().empty());
  ASSERT_TRUE(viewer.send(transport::InputKind::kGravity, {1, 2, 3}, {}, now()));
  viewer.port().disconnected();
  viewer.port().connected();
  give(server.session);
  poll();
  EXPECT_THAT(viewer.take_events(), HasSubstr(R"("number":1,"kind":"unknown")"));
  const auto next = viewer.send(transport::InputKind::kGravity, {1, 2, 3}, {}, now());
  ASSERT_TRUE(next);
  EXPECT_EQ(*next, 2U);
}

TEST_F(WebClientTest, AConnectionThatBeginsAnewIsJoined) {
  join();
  frame();
  viewer.port().disconnected();
  sent.clear();
  viewer.port().connected(true);
  give(server.session);
  poll();
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(std::get<transport::AckMessage>(sent[0]).phase, transport::Phase::kJoining);
  give(server.advance(now_ns));
  give(server.snapshot());
  poll();
  EXPECT_EQ(viewer.core().statistics().epochs, 2U);
  EXPECT_EQ(viewer.core().timeline()->hash(), server.hashes[server.frame()]);
}

TEST_F(WebClientTest, WhatTheSessionSaysOfItselfIsThereOnceItIsKnown) {
  EXPECT_EQ(viewer.types(), "[]");
  EXPECT_EQ(viewer.scene_json(), "");
  EXPECT_EQ(viewer.sample(SampleMode::kExtrapolate, now()), nullptr);
  server.session.scene_json = R"({"planes":[]})";
  server.session.types[0].name = "b\"all";
  join();
  EXPECT_THAT(viewer.types(), HasSubstr(R"([{"name":"b\u0022all","radius":0.1)"));
  EXPECT_THAT(viewer.types(), HasSubstr(R"("colour":"#ffffffff","shape":"sphere","shapeValues":[]}])"));
  EXPECT_EQ(viewer.scene_json(), R"({"planes":[]})");
  const Sample* const sample = viewer.sample(SampleMode::kExtrapolate, now());
  ASSERT_NE(sample, nullptr);
  EXPECT_EQ(sample->capacity, 40U);
}

}  // namespace
}  // namespace tandem::web
