// Tests what a link of the simulated network does to samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "sdk/transport/simulated/network.hpp"

namespace tandem::transport::simulated::of_links {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// A server and a client that have found each other, over a perfect link.
struct Pair {
  explicit Pair(std::uint64_t seed = 1)
      : network({.seed = seed, .link = {.delay_ns = 0}}),
        server(std::move(*network.make_server("s", 10'000))),
        client(std::move(*network.make_client("s", 10'000))) {
    SessionMessage session;
    session.session = "s";
    session.epoch = 7;
    session.streams.resize(1);
    session.streams[0].max_delta_bytes = 1000;
    EXPECT_TRUE(client->open_stream(session, session.streams[0], 77));
    network.advance_to(100 * kMs);
  }
  void publish(Frame frame, std::size_t bytes = 0) {
    DeltaMessage message;
    message.epoch = 7;
    message.frame = frame;
    message.payload.resize(bytes);
    EXPECT_TRUE(server->write(message));
  }
  std::vector<Frame> arrived() {
    std::vector<Received<DeltaMessage>> received;
    client->take(received);
    std::vector<Frame> out;
    for (const auto& each : received) out.push_back(each.message.frame);
    return out;
  }
  Network network;
  std::unique_ptr<ServerPort> server;
  std::unique_ptr<ClientPort> client;
};

TEST(SimulatedLinks, ALostSampleComesAgainARoundTripLaterAndHoldsUpTheNext) {
  Pair pair;
  pair.network.set_link(pair.client->self(), pair.server->self(), {.delay_ns = 70 * kMs});
  pair.network.set_link(pair.server->self(), pair.client->self(), {.delay_ns = 30 * kMs, .loss = 1});
  pair.publish(1);
  pair.network.set_link(pair.server->self(), pair.client->self(), {.delay_ns = 30 * kMs});
  pair.publish(2);
  const std::int64_t due_ns = 100 * kMs + 30 * kMs + kNackNs + 70 * kMs + 30 * kMs;
  pair.network.advance_to(due_ns - 1);
  EXPECT_TRUE(pair.arrived().empty());
  pair.network.advance_to(due_ns);
  EXPECT_EQ(pair.arrived(), (std::vector<Frame>{1, 2}));
  EXPECT_EQ(pair.network.counts().repaired, 1U);
}

TEST(SimulatedLinks, RowsOfLossesHaveTheLengthAndTheShareAskedFor) {
  Pair pair(3);
  const double share = 0.1, length = 10;
  pair.network.set_all_links(
      {.delay_ns = 0, .lost_for_good = 1, .burst_loss = share, .burst_samples = length});
  constexpr Frame kFrames = 9'000;
  for (Frame frame = 1; frame <= kFrames; ++frame) pair.publish(frame);
  pair.network.advance_to(200 * kMs);
  const std::vector<Frame> arrived = pair.arrived();
  double rows = 0;
  for (std::size_t i = 1; i < arrived.size(); ++i) rows += arrived[i] != arrived[i - 1] + 1 ? 1 : 0;
  const double lost = kFrames - static_cast<double>(arrived.size());
  EXPECT_NEAR(lost / kFrames, share, 0.04);
  EXPECT_NEAR(lost / rows, length, 3);
}

TEST(SimulatedLinks, ADuplicateIsHandedOverOnceAndTakesItsShareOfTheRate) {
  Pair pair;
  const auto narrow = std::make_shared<Bottleneck>(BottleneckOptions{1e6, 0, 1000 * kMs});
  pair.network.set_all_links({.delay_ns = 0, .bottleneck = narrow, .duplicates = 1});
  for (Frame frame = 1; frame <= 10; ++frame) pair.publish(frame, 850);  // and 150 around them: 8 ms each
  pair.network.advance_to(100 * kMs + (10 + 9) * 8 * kMs - 1);
  EXPECT_EQ(pair.arrived().size(), 9U);
  pair.network.advance_to(100 * kMs + (10 + 9) * 8 * kMs);
  EXPECT_EQ(pair.arrived(), (std::vector<Frame>{10}));
  EXPECT_EQ(pair.network.counts().duplicated, 10U);
}

TEST(SimulatedLinks, WhatWasOvertakenOnABestEffortTopicDoesNotComeAndOnAReliableOneWaits) {
  Pair pair;
  pair.network.set_all_links({.delay_ns = 0, .jitter_ns = 50 * kMs});
  constexpr std::uint64_t kSent = 100;
  for (std::uint64_t i = 1; i <= kSent; ++i) {
    ServerStatusMessage status;
    status.epoch = 7;
    status.frame = i;
    EXPECT_TRUE(pair.server->write(status));
    pair.publish(i);
    pair.network.advance_to(pair.network.now_ns() + kMs);
  }
  pair.network.advance_to(1000 * kMs);
  EXPECT_EQ(pair.arrived().size(), kSent);
  EXPECT_GT(pair.network.counts().overtaken, kSent / 2);
  EXPECT_LT(pair.network.counts().overtaken, kSent);
}

TEST(SimulatedLinks, FindingEachOtherTakesWhatTheLinksTakeWhereAskedFor) {
  Network network(
      {.link = {.delay_ns = 100 * kMs}, .match_min_ns = 0, .match_max_ns = 0, .match_over_links = true});
  const auto server = std::move(*network.make_server("s"));
  const auto client = std::move(*network.make_client("s"));
  network.advance_to(300 * kMs - 1);
  EXPECT_FALSE(server->alive(client->self()));
  network.advance_to(300 * kMs);
  EXPECT_TRUE(server->alive(client->self())) << "a round trip, and one way for the news of its writer";
}

}  // namespace
}  // namespace tandem::transport::simulated::of_links
