// Tests what a session client tells its sinks before it plays a stream.
#include "services/follow/following/session_client.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/client/fake_server.hpp"

namespace tandem::following {
namespace {

class Told final : public SessionSink {
 public:
  void on_session(const transport::SessionMessage& session) override { sessions.push_back(session); }
  void on_unplayed(const transport::SessionMessage& session) override { unplayed.push_back(session); }
  void on_status(const transport::ServerStatusMessage& status, std::int64_t /*now_ns*/) override {
    statuses.push_back(status.stream);
  }

  std::vector<transport::SessionMessage> sessions, unplayed;
  std::vector<std::uint32_t> statuses;
};

class SessionClientTest : public ::testing::Test {
 protected:
  static client::CoreOptions options() {
    client::CoreOptions options;
    options.session = "default";
    options.id = client::kClient;
    return options;
  }
  void announce() {
    for (auto& stream : server.session.streams)
      stream.layout_hash = transport::layout_hash(server.session, stream);
    port.sessions.push_back(client::from_server(server.session));
  }
  void tell_status(std::uint32_t stream) {
    transport::ServerStatusMessage status;
    status.session = "default";
    status.epoch = server.session.epoch;
    status.stream = stream;
    status.mbit_per_s = 1;
    port.server_statuses.push_back(client::from_server(status));
  }
  void poll() {
    now_ns += client::kMs;
    follows.poll(told, {now_ns, now_ns});
  }

  client::FakeServer server;
  client::FakePort port;
  Told told;
  SessionClient follows{options(), port};
  std::int64_t now_ns = 1'000'000'000'000;
};

TEST_F(SessionClientTest, ASessionThatCannotBePlayedIsToldOnceAsUnplayed) {
  server.session.streams[0].layout.codec = "of another build";
  announce();
  for (int i = 0; i < 5; ++i) poll();
  ASSERT_EQ(told.unplayed.size(), 1U);
  EXPECT_EQ(told.unplayed[0].epoch, server.session.epoch);
  EXPECT_TRUE(told.sessions.empty());
  EXPECT_FALSE(follows.playing());
  EXPECT_FALSE(follows.cut());
}

TEST_F(SessionClientTest, UntilAStreamIsChosenSinksAreToldTheStatusOfTheFirst) {
  server.session.streams.push_back(server.session.streams[0]);
  server.session.streams[1].id = {.id = 1, .generation = 0};
  server.session.streams[1].carries = 1;
  server.session.streams[1].client_cost_ns = 70;
  announce();
  poll();
  ASSERT_EQ(told.unplayed.size(), 1U) << "the client waits for what the streams cost";
  EXPECT_TRUE(told.sessions.empty());
  tell_status(0);
  poll();
  EXPECT_EQ(told.statuses, std::vector<std::uint32_t>{0});

  tell_status(1);
  poll();
  ASSERT_EQ(told.sessions.size(), 1U);
  ASSERT_EQ(told.sessions[0].streams.size(), 1U) << "the one that is played";
  EXPECT_EQ(told.unplayed.size(), 1U);
  const std::uint32_t played = told.sessions[0].streams[0].id.id;
  told.statuses.clear();
  tell_status(0);
  tell_status(1);
  poll();
  EXPECT_EQ(told.statuses, std::vector<std::uint32_t>{played});
}

TEST_F(SessionClientTest, AnOfferThatCarriesAnothersFramesIsToldAsAStreamOfItsOwn) {
  server.session.streams.push_back(server.session.streams[0]);
  server.session.streams[0].delay_ms = 200;
  server.session.streams[1].id.id = 1;
  announce();
  poll();
  ASSERT_EQ(told.sessions.size(), 1U) << "there is nothing to choose by what streams cost";
  ASSERT_EQ(told.sessions[0].streams.size(), 1U);
  EXPECT_EQ(told.sessions[0].streams[0].id.id, 1U) << "without a delay";
  EXPECT_EQ(told.sessions[0].streams[0].carries, 1U) << "as who is told knows no other";
}

}  // namespace
}  // namespace tandem::following
