// Two servers of one session.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/fault/host/stage.hpp"

namespace tandem::host {
namespace {

// A refused server leaves, as tandemd does.
void leave_if_refused(Server& server) {
  if (server.host == nullptr || server.host->state() != Host::State::kRefused) return;
  server.host.reset();
  server.port.reset();
}

TEST(Rivals, OfTwoServersStartingWithinASecondExactlyOneStaysAndClientsPlayIt) {
  for_seeds(60, [](std::uint64_t seed) {
    Dice dice(seed);
    Stage stage(seed, {.delay_ns = 1'000'000 + static_cast<std::int64_t>(dice.below(20'000'000)),
                       .jitter_ns = 5'000'000});
    stage.add_client();
    stage.add_client(transport::Role::kObserver);
    stage.run_ms(static_cast<std::int64_t>(dice.below(50)));
    stage.add_server(1'000'000);
    stage.run_ms(static_cast<std::int64_t>(dice.below(1000)));
    stage.add_server(1'000'000 + dice.below(1500));
    stage.on_ms = [&] {
      for (auto& server : stage.servers) leave_if_refused(*server);
    };
    stage.run_ms(4000);
    const auto staying =
        std::ranges::count_if(stage.servers, [](const auto& server) { return server->host != nullptr; });
    ASSERT_EQ(staying, 1);
    const auto& winner =
        *std::ranges::find_if(stage.servers, [](const auto& s) { return s->host != nullptr; });
    EXPECT_EQ(winner->host->state(), Host::State::kRunning);
    for (const auto& client : stage.clients) EXPECT_TRUE(Stage::plays(*client, *winner->host));
  });
}

TEST(Rivals, ALaterServerLeavesAndTheClientsOfTheFirstDoNotNotice) {
  for_seeds(30, [](std::uint64_t seed) {
    Dice dice(seed);
    Stage stage(seed, {.delay_ns = 2'000'000, .jitter_ns = 10'000'000});
    Server& first = stage.add_server(1'000'000);
    Client& client = stage.add_client();
    stage.run_ms(3000);
    ASSERT_TRUE(Stage::plays(client, *first.host));
    Server& second = stage.add_server(1'004'000 - dice.below(2) * 1'000'000);  // even one with an older epoch
    stage.run_ms(600);
    EXPECT_EQ(second.host->state(), Host::State::kRefused);
    EXPECT_EQ(second.host->error()->code, ErrorCode::kConflict);
    second.host.reset();
    second.port.reset();
    stage.run_ms(1000);
    EXPECT_EQ(client.core->statistics().epochs, 1U);
    EXPECT_EQ(client.core->statistics().resyncs, 0U);
    EXPECT_TRUE(Stage::plays(client, *first.host));
  });
}

TEST(Rivals, AServerThatWasAwayWhileAnotherTookOverLeavesAndNoClientGoesBackToIt) {
  for_seeds(20, [](std::uint64_t seed) {
    Dice dice(seed);
    Stage stage(seed, {.delay_ns = 2'000'000, .jitter_ns = 10'000'000});
    Server& first = stage.add_server(1'000'000);
    for (int i = 0; i < 3; ++i) stage.add_client();
    stage.run_ms(3000);
    stage.set_frozen(first, true);
    stage.run_ms(2000);
    Server& second = stage.add_server(1'005'000);
    stage.run_ms(3000 + static_cast<std::int64_t>(dice.below(30'000)));
    for (const auto& client : stage.clients) ASSERT_TRUE(Stage::plays(*client, *second.host));
    stage.set_frozen(first, false);
    stage.on_ms = [&] { leave_if_refused(first); };
    stage.run_ms(5000);
    EXPECT_EQ(first.host, nullptr) << "left";
    EXPECT_EQ(second.host->state(), Host::State::kRunning);
    for (const auto& client : stage.clients) {
      EXPECT_TRUE(Stage::plays(*client, *second.host));
      EXPECT_EQ(client->core->statistics().epochs, 2U);
    }
  });
}

TEST(Rivals, AForgedAnnouncementMovesNeitherServerNorClients) {
  Stage stage(1);
  Server& server = stage.add_server(1'000'000);
  Client& client = stage.add_client();
  stage.run_ms(5000);
  std::vector<std::unique_ptr<transport::ServerPort>> forgers;
  for (Epoch i = 0; i < 80; ++i) {
    forgers.push_back(must(stage.network.make_server("default")));
    transport::SessionMessage forged = server.host->session();
    forged.epoch = i % 2 == 0 ? 5 + i : 2'000'000 + i;
    ASSERT_TRUE(forgers.back()->write(forged));
  }
  stage.run_ms(10'000);
  EXPECT_EQ(server.host->state(), Host::State::kRunning);
  EXPECT_TRUE(Stage::plays(client, *server.host));
  EXPECT_EQ(client.core->statistics().epochs, 1U);
}

// A participant that announces what a live server announced, word for word.
std::unique_ptr<transport::ServerPort> imitator_of(Stage& stage, transport::SessionMessage session) {
  auto port = must(stage.network.make_server("default"));
  EXPECT_TRUE(port->write(session));
  return port;
}

TEST(Rivals, WhoAnnouncesTheEpochOfALiveServerEndsItWithNoGuid) {
  for_seeds(8, [](std::uint64_t seed) {
    Stage stage(seed);
    Server& server = stage.add_server(1'000'000);
    Client& client = stage.add_client();
    stage.run_ms(4000);
    const auto imitator = imitator_of(stage, server.host->session());
    stage.run_ms(10'000);
    EXPECT_EQ(server.host->state(), Host::State::kRunning);
    EXPECT_TRUE(Stage::plays(client, *server.host));
    EXPECT_EQ(client.core->statistics().resyncs, 0U);
    const auto notices = server.host->take_notices();
    EXPECT_EQ(std::ranges::count_if(
                  notices, [](const std::string& line) { return line.find("1000000") != std::string::npos; }),
              1);
  });
}

// The server is silent for longer than its lease, and so the client turns to the other one.
TEST(Rivals, AClientLeavesWhoOnlyAnnouncesTheEpochThatItPlays) {
  for (const bool word_for_word : {true, false}) {
    Stage stage(1);
    Server& server = stage.add_server(1'000'000);
    Client& client = stage.add_client();
    stage.run_ms(4000);
    transport::SessionMessage session = server.host->session();
    if (!word_for_word) session.scene = "other";
    const auto imitator = imitator_of(stage, session);
    stage.run_ms(1000);
    stage.set_frozen(server, true);
    stage.run_ms(1500);
    stage.set_frozen(server, false);
    stage.run_ms(4000);
    ASSERT_TRUE(Stage::plays(client, *server.host)) << word_for_word;
    EXPECT_GE(client.core->timeline()->applied() + 3, server.host->frame());
    EXPECT_TRUE(!word_for_word || client.core->statistics().resyncs == 0);
  }
}

TEST(Rivals, AClientGoesOnToTheNextServerWhoeverAnnouncesTheEpochOfTheLast) {
  Stage stage(1);
  Server& server = stage.add_server(1'000'000);
  Client& client = stage.add_client();
  stage.run_ms(4000);
  const auto imitator = imitator_of(stage, server.host->session());
  stage.run_ms(1000);
  stage.network.kill(server.port->self());
  server.host.reset();
  stage.run_ms(4000);
  EXPECT_FALSE(client.core->server_alive());
  auto next = must(stage.network.make_server("default"));
  transport::SessionMessage session = *client.core->session();
  session.epoch = 1'009'000;
  ASSERT_TRUE(next->write(session));
  stage.run_ms(1000);
  EXPECT_EQ(client.core->session()->epoch, session.epoch);
}

}  // namespace
}  // namespace tandem::host
