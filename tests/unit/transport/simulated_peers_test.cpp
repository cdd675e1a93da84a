// Tests what the peers of the simulated network see of one another: kills, pauses, cut links, other servers.
#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "tests/unit/transport/simulated_pair.hpp"

namespace tandem::transport::simulated {
namespace {

TEST(Simulated, AKilledClientIsNoticedAfterTheLeaseAndAClosedOneAtOnce) {
  Pair pair(NetworkOptions{});
  auto second = std::move(*pair.network.make_client("s"));
  pair.run(100 * kMs);
  const ParticipantId first_id = pair.client->self();
  const ParticipantId second_id = second->self();
  ASSERT_TRUE(pair.server->alive(second_id));
  pair.network.kill(first_id);
  second.reset();
  EXPECT_FALSE(pair.server->alive(second_id));
  pair.run(999 * kMs);
  EXPECT_TRUE(pair.server->alive(first_id));
  pair.run(kMs);
  EXPECT_FALSE(pair.server->alive(first_id));
  EXPECT_FALSE(pair.server->joined(first_id, kClient, 0));
  EXPECT_FALSE(pair.client->write(ack(1, 1)));
}

TEST(Simulated, ClientsNoticeTheEndOfAServerAndTheNextOne) {
  Pair pair(NetworkOptions{});
  EXPECT_TRUE(pair.client->server_alive());
  pair.network.kill(pair.server->self());
  const auto next = std::move(*pair.network.make_server("s"));
  ASSERT_TRUE(next->write(session(kEpoch + 1)));
  std::vector<Received<SessionMessage>> sessions;
  pair.client->take_sessions(sessions);
  sessions.clear();
  pair.run(100 * kMs);
  pair.client->take_sessions(sessions);
  EXPECT_TRUE(sessions.empty()) << "the lease of the first has not run out";
  EXPECT_TRUE(pair.client->server_alive());
  pair.run(1000 * kMs);
  EXPECT_FALSE(pair.client->server_alive());
  pair.client->take_sessions(sessions);
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].message.epoch, kEpoch + 1);
  ASSERT_TRUE(open_stream(*pair.client, session(kEpoch + 1)));
  EXPECT_TRUE(pair.client->server_alive());
}

TEST(Simulated, AFrozenClientGetsAfterwardsWhatTheServerStillKeeps) {
  Pair pair(NetworkOptions{}, 8);
  pair.network.set_frozen(pair.client->self(), true);
  for (Frame frame = 1; frame <= 20; ++frame) {
    ASSERT_TRUE(pair.server->write(delta(frame)));
    pair.run(100 * kMs);
  }
  EXPECT_FALSE(pair.server->alive(pair.client->self()));
  pair.network.set_frozen(pair.client->self(), false);
  EXPECT_TRUE(pair.server->alive(pair.client->self()));
  pair.run(100 * kMs);
  EXPECT_EQ(frames(*pair.client), range(13, 20));
}

TEST(Simulated, ACutLinkDeliversNothingUntilMended) {
  Pair pair(NetworkOptions{});
  const auto other = std::move(*pair.network.make_client("s"));
  ASSERT_TRUE(open_stream(*other));
  pair.run(100 * kMs);
  pair.network.set_cut(pair.server->self(), pair.client->self(), true);
  ASSERT_TRUE(pair.server->write(delta(1)));
  ASSERT_TRUE(pair.client->write(ack(1, 1)));
  pair.run(2000 * kMs);
  EXPECT_TRUE(frames(*pair.client).empty());
  EXPECT_TRUE(take<AckMessage>(*pair.server).empty());
  EXPECT_FALSE(pair.client->server_alive());
  EXPECT_EQ(frames(*other), range(1, 1));
  EXPECT_TRUE(other->server_alive());
  pair.network.set_cut(pair.server->self(), pair.client->self(), false);
  pair.run(100 * kMs);
  EXPECT_EQ(frames(*pair.client), range(1, 1));
  EXPECT_EQ(take<AckMessage>(*pair.server).size(), 1U);
  EXPECT_TRUE(pair.client->server_alive());
}

TEST(Simulated, AServerSeesOthersButNotItself) {
  Network network(NetworkOptions{});
  const auto first = std::move(*network.make_server("s"));
  const auto second = std::move(*network.make_server("s"));
  const auto elsewhere = std::move(*network.make_server("t"));
  ASSERT_TRUE(first->write(session(1)));
  ASSERT_TRUE(second->write(session(2)));
  network.advance_to(100 * kMs);
  std::vector<Received<SessionMessage>> sessions;
  first->take_sessions(sessions);
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].from, second->self());
  sessions.clear();
  elsewhere->take_sessions(sessions);
  EXPECT_TRUE(sessions.empty());
}

}  // namespace
}  // namespace tandem::transport::simulated
