// Keys and events of tandem::Server, and clients of tandem::Client that hear of them, over DDS.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "tandem/client.hpp"
#include "tandem/host.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kEvents = 10'000;

/// One body that stands still.
class Still final : public engine::Simulation {
 public:
  [[nodiscard]] std::uint32_t capacity() const override { return 1; }
  [[nodiscard]] double dt_s() const override { return 0.01; }
  [[nodiscard]] engine::Vec3 gravity() const override { return {}; }
  void step() override {
    if (on_step) on_step();
  }
  [[nodiscard]] engine::NewsFeatures tells() const override { return features; }
  void tell(engine::StepNews& news) override {
    if (on_tell) on_tell(news);
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    return {
        .position = {zero_, zero_, zero_}, .velocity = {zero_, zero_, zero_}, .alive = alive_, .type = type_};
  }
  std::function<void()> on_step;
  engine::NewsFeatures features;
  std::function<void(engine::StepNews&)> on_tell;

 private:
  std::vector<float> zero_ = {0};
  std::vector<std::uint8_t> alive_ = {1};
  std::vector<std::uint16_t> type_ = {0};
};

/// What one client was told.
struct Listener {
  Client client;
  std::vector<tandem_news> events;
  std::uint64_t lost = 0;

  void listen() {
    while (const auto news = client.next_news()) {
      if (news->what == TANDEM_NEWS_EVENT) events.push_back(*news);
      if (news->what == TANDEM_NEWS_LOST) lost += news->number;
    }
  }
  /// Each once and in order, with the bytes that were sent.
  void expect_all(std::uint32_t count) const {
    EXPECT_EQ(lost, 0U);
    ASSERT_EQ(events.size(), count);
    std::uint64_t frame = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      std::uint32_t sent = 0;
      ASSERT_EQ(events[i].byte_count, sizeof sent);
      std::memcpy(&sent, events[i].bytes, sizeof sent);
      ASSERT_EQ(sent, i);
      ASSERT_EQ(events[i].kind, i % 7);
      ASSERT_GE(events[i].frame, frame);
      frame = events[i].frame;
    }
  }
};

class NewsOverDds : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ::setenv("CYCLONEDDS_URI",
             "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
             "multicast=\"true\"/></Interfaces></General><Discovery><Tag>news-test</Tag></Discovery>"
             "</Domain></CycloneDDS>",
             1);
  }
  [[nodiscard]] static Listener join(ClientRole role) {
    auto client = Client::connect({.session = "news", .domain = 73, .role = role});
    if (!client) throw std::runtime_error(client.error().message);
    return {.client = std::move(*client), .events = {}};
  }
  static bool plays(const Listener& listener) {
    const auto status = listener.client.status();
    return status && status->phase == ClientPhase::kPlaying;
  }
  template <class Done>
  static bool poll_until(Server& server, const Done& done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{60};
    while (!done() && std::chrono::steady_clock::now() < end)
      if (!server.poll(0.01)) return false;
    return done();
  }
  static std::span<const std::byte> bytes(const auto& value) { return std::as_bytes(std::span(&value, 1)); }

  Still simulation;
  ServerOptions options{.session = "news", .domain = 73, .keys = true, .events = true};
};

TEST_F(NewsOverDds, TenThousandEventsReachEveryClientOnceAndInOrder) {
  options.delivery_delays_s = {0.1};
  auto server = Server::start(options, simulation);
  ASSERT_TRUE(server) << server.error().message;
  std::vector<Listener> listeners;
  for (const ClientRole role :
       {ClientRole::kParticipant, ClientRole::kParticipant, ClientRole::kObserver, ClientRole::kObserver})
    listeners.push_back(join(role));
  const auto all = [&](const auto& is) { return std::ranges::all_of(listeners, is); };
  ASSERT_TRUE(server->set_key("phase", bytes('p')));
  ASSERT_TRUE(poll_until(*server, [&] { return all(plays); }));

  std::uint32_t sent = 0;
  std::uint64_t refused = 0;
  simulation.on_step = [&] {  // as an engine does, more than a frame holds at times
    for (int i = 0; i < 100 && sent < kEvents; ++i) {
      if (!server->broadcast(sent % 7, bytes(sent), 0)) {
        ++refused;
        return;
      }
      ++sent;
    }
  };
  const bool told = poll_until(*server, [&] {
    for (Listener& listener : listeners) listener.listen();
    return all([](const Listener& listener) { return listener.events.size() + listener.lost >= kEvents; });
  });
  EXPECT_TRUE(told);
  EXPECT_GT(refused, 0U) << "the queue was never full, so the test shows less than it should";
  for (const Listener& listener : listeners) {
    listener.expect_all(kEvents);
    EXPECT_EQ(listener.client.status()->hash_mismatches, 0U);
    EXPECT_EQ(listener.client.keys(), std::vector<std::string>{"phase"});
  }
}

TEST_F(NewsOverDds, WhoJoinsLaterHasTheKeysAndHearsWhatHappensFromThenOn) {
  auto server = Server::start(options, simulation);
  ASSERT_TRUE(server) << server.error().message;
  ASSERT_TRUE(server->set_key("score", bytes('1')));
  ASSERT_TRUE(server->broadcast(1));
  Listener listener = join(ClientRole::kObserver);
  ASSERT_TRUE(poll_until(*server, [&] { return plays(listener); }));
  ASSERT_EQ(listener.client.key("score"), std::vector<std::byte>{std::byte{'1'}});
  EXPECT_FALSE(listener.client.key("other"));
  listener.listen();
  EXPECT_TRUE(listener.events.empty());
  ASSERT_TRUE(server->broadcast(2, {}, 0));
  ASSERT_TRUE(server->remove_key("score"));
  ASSERT_TRUE(poll_until(*server, [&] {
    listener.listen();
    return !listener.events.empty() && listener.client.keys().empty();
  }));
  EXPECT_EQ(listener.events[0].number, 2U);
  EXPECT_EQ(listener.events[0].has_body, 1U);
  EXPECT_EQ(listener.lost, 0U);
}

TEST_F(NewsOverDds, ASimulationThatTellsThemBringsTheFeatures) {
  options.keys = options.events = false;
  simulation.features = {.keys = true, .events = true};
  simulation.on_tell = [](engine::StepNews& news) {
    EXPECT_TRUE(news.set_key("score", bytes('1')));
    EXPECT_TRUE(news.broadcast(3, {}, 0));
  };
  auto server = Server::start(options, simulation);
  ASSERT_TRUE(server) << server.error().message;
  Listener listener = join(ClientRole::kObserver);
  ASSERT_TRUE(poll_until(*server, [&] {
    listener.listen();
    return !listener.events.empty();
  }));
  EXPECT_EQ(listener.events[0].kind, 3U);
  EXPECT_EQ(listener.client.keys(), std::vector<std::string>{"score"});
  EXPECT_TRUE(server->set_key("of the application", {}));
}

TEST_F(NewsOverDds, ASessionWithoutThemRefusesByName) {
  options.keys = options.events = false;
  auto server = Server::start(options, simulation);
  ASSERT_TRUE(server) << server.error().message;
  EXPECT_EQ(server->set_key("a", {}).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(server->remove_key("a").error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(server->broadcast(1).error().code, ErrorCode::kUnsupported);
}

}  // namespace
}  // namespace tandem
