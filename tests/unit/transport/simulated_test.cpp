// Tests what the simulated network does to samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/unit/transport/simulated_pair.hpp"

namespace tandem::transport::simulated {
namespace {

TEST(Simulated, NothingArrivesBeforeTheDelayOfItsLink) {
  NetworkOptions options;
  options.link.delay_ns = 5 * kMs;
  Pair pair(options);
  ASSERT_TRUE(pair.server->write(delta(1)));
  pair.run(5 * kMs - 1);
  EXPECT_TRUE(frames(*pair.client).empty());
  pair.run(1);
  EXPECT_EQ(frames(*pair.client), range(1, 1));
}

TEST(Simulated, WritersReachOnlyReadersTheyAreMatchedWith) {
  NetworkOptions options;
  options.match_min_ns = options.match_max_ns = 10 * kMs;
  Network network(options);
  const auto server = std::move(*network.make_server("s"));
  const auto client = std::move(*network.make_client("s"));
  ASSERT_TRUE(open_stream(*client));
  ASSERT_TRUE(server->write(delta(1)));
  network.advance_to(10 * kMs - 1);
  EXPECT_FALSE(server->alive(client->self()));
  network.advance_to(10 * kMs);
  EXPECT_TRUE(server->alive(client->self()));
  ASSERT_TRUE(server->open_client(kClient));
  network.advance_to(20 * kMs);
  EXPECT_FALSE(server->joined(client->self(), kClient, 0)) << "no snapshot reader yet";
  ASSERT_TRUE(server->write(delta(2)));
  ASSERT_TRUE(client->open_snapshots(0));
  network.advance_to(40 * kMs);
  EXPECT_TRUE(server->joined(client->self(), kClient, 0));
  EXPECT_FALSE(server->joined(client->self(), kClient + 1, 0)) << "a client that is not open";
  EXPECT_EQ(frames(*client), range(2, 2)) << "deltas are volatile";
}

TEST(Simulated, DeltasReachOnlyThoseWhoOpenedTheStreamAndSnapshotsTheirClientAlone) {
  Network network(NetworkOptions{});
  const auto server = std::move(*network.make_server("s"));
  const auto thin = std::move(*network.make_client("s"));
  const auto rich = std::move(*network.make_client("s"));
  SessionMessage two = session();
  two.streams.push_back(two.streams[0]);
  two.streams[1].id.id = 1;
  ASSERT_TRUE(server->open_streams(2));
  ASSERT_TRUE(server->open_streams(1)) << "what is open stays";
  for (const auto& [client, stream] : {std::pair{thin.get(), 0U}, std::pair{rich.get(), 1U}}) {
    ASSERT_TRUE(client->open_stream(two, two.streams[stream], kClient + stream));
    ASSERT_TRUE(client->open_snapshots(stream));
    ASSERT_TRUE(server->open_client(kClient + stream));
  }
  network.advance_to(100 * kMs);
  EXPECT_TRUE(server->joined(rich->self(), kClient + 1, 1));
  EXPECT_FALSE(server->joined(rich->self(), kClient + 1, 0));
  EXPECT_FALSE(server->joined(rich->self(), kClient, 1)) << "not its own client";
  EXPECT_TRUE(server->joined(thin->self(), kClient, 0));
  EXPECT_FALSE(server->joined(thin->self(), kClient, 1));
  for (const std::uint32_t stream : {0U, 1U}) {
    DeltaMessage message = delta(10 + stream);
    SnapshotMessage cut = snapshot(20 + stream);
    message.stream.id = cut.stream.id = stream;
    ASSERT_TRUE(server->write(message));
    ASSERT_TRUE(server->write(kClient + stream, cut));
  }
  ASSERT_TRUE(server->write(scheduled(1)));
  network.advance_to(200 * kMs);
  EXPECT_EQ(frames(*thin), range(10, 10));
  EXPECT_EQ(frames(*rich), range(11, 11));
  EXPECT_EQ(take<SnapshotMessage>(*thin).at(0).message.frame, 20U);
  EXPECT_EQ(take<SnapshotMessage>(*rich).at(0).message.frame, 21U);
  EXPECT_EQ(take<ScheduledInputMessage>(*thin).size(), 1U);
  EXPECT_EQ(take<ScheduledInputMessage>(*rich).size(), 1U) << "inputs are those of all";
}

TEST(Simulated, AStreamThatIsNotOpenIsNotWritten) {
  Network network(NetworkOptions{});
  const auto server = std::move(*network.make_server("s"));
  EXPECT_FALSE(server->open_streams(0));
  EXPECT_FALSE(server->open_streams(9));
  DeltaMessage message = delta(1);
  message.stream.id = 1;
  EXPECT_EQ(server->write(message).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(server->write(kClient, snapshot(1)).error().code, ErrorCode::kInvalidArgument);
  EXPECT_FALSE(server->joined(server->self(), kClient, 1));
}

TEST(Simulated, TransientLocalTopicsHandTheirHistoryToLateReaders) {
  Network network(NetworkOptions{});
  const auto server = std::move(*network.make_server("s"));
  ASSERT_TRUE(server->write(session()));
  for (std::uint64_t number = 1; number <= 300; ++number) ASSERT_TRUE(server->write(scheduled(number)));
  ASSERT_TRUE(server->open_client(kClient));
  ASSERT_TRUE(server->write(kClient, snapshot(1)));
  const auto client = std::move(*network.make_client("s"));
  ASSERT_TRUE(open_stream(*client));
  ASSERT_TRUE(client->open_snapshots(0));
  network.advance_to(100 * kMs);
  std::vector<Received<SessionMessage>> sessions;
  client->take_sessions(sessions);
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].message, session());
  EXPECT_EQ(sessions[0].from, server->self());
  const auto inputs = take<ScheduledInputMessage>(*client);
  ASSERT_EQ(inputs.size(), 256U);
  EXPECT_EQ(inputs.front().message.number, 45U);
  EXPECT_EQ(inputs.back().message.number, 300U);
  EXPECT_TRUE(take<SnapshotMessage>(*client).empty()) << "snapshots are volatile";
}

TEST(Simulated, APartThatIsOlderThanItsLifespanIsNotRepaired) {
  for (const std::int64_t cut_ms : {200, 400}) {
    NetworkOptions options;
    options.part_lifespan_ns = 300 * kMs;
    Network network(options);
    const auto server = std::move(*network.make_server("s"));
    const auto client = std::move(*network.make_client("s"));
    ASSERT_TRUE(client->open_stream(session(), session().streams[0], kClient));
    ASSERT_TRUE(client->open_snapshots(0));
    ASSERT_TRUE(server->open_client(kClient));
    network.advance_to(100 * kMs);
    network.set_cut_one_way(server->self(), client->self(), true);
    ASSERT_TRUE(server->write(kClient, snapshot(1)));
    ASSERT_TRUE(server->write(delta(1)));
    network.advance_to((100 + cut_ms) * kMs);
    network.set_cut_one_way(server->self(), client->self(), false);
    network.advance_to(1000 * kMs);
    EXPECT_EQ(take<SnapshotMessage>(*client).size(), cut_ms < 300 ? 1U : 0U);
    EXPECT_EQ(frames(*client), range(1, 1)) << "a delta has no lifespan";
  }
}

TEST(Simulated, ACutLinkLosesNoScheduledInputThatIsStillKept) {
  Network network(NetworkOptions{});
  const auto server = std::move(*network.make_server("s"));
  const auto client = std::move(*network.make_client("s"));
  ASSERT_TRUE(open_stream(*client));
  network.advance_to(100 * kMs);
  network.set_cut(server->self(), client->self(), true);
  for (std::uint64_t number = 1; number <= 4096; ++number) ASSERT_TRUE(server->write(scheduled(number)));
  network.set_cut(server->self(), client->self(), false);
  network.advance_to(2000 * kMs);
  EXPECT_EQ(take<ScheduledInputMessage>(*client).size(), 4096U);
}

TEST(Simulated, LostSamplesAreRepairedInOrderWhateverTheSeed) {
  std::uint64_t repaired = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    NetworkOptions options;
    options.seed = seed;
    options.link = LinkModel{5 * kMs, 30 * kMs, 0.3, 20 * kMs, 0};
    Pair pair(options, 1000);
    std::vector<Frame> got;
    for (Frame frame = 1; frame <= 100; ++frame) {
      ASSERT_TRUE(pair.server->write(delta(frame)));
      pair.run(33 * kMs);
      for (const Frame taken : frames(*pair.client)) got.push_back(taken);
    }
    pair.run(10'000 * kMs);
    for (const Frame taken : frames(*pair.client)) got.push_back(taken);
    ASSERT_EQ(got, range(1, 100)) << "seed " << seed;
    repaired += pair.network.counts().repaired;
  }
  EXPECT_GT(repaired, 0U);
}

TEST(Simulated, ALostSampleHoldsUpLaterOnesOfItsTopicOnly) {
  NetworkOptions options;
  options.link = LinkModel{kMs, 0, 0, 50 * kMs, 0};
  Pair pair(options);
  pair.network.set_link(pair.server->self(), pair.client->self(), LinkModel{kMs, 0, 1, 50 * kMs, 0});
  ASSERT_TRUE(pair.server->write(delta(1)));
  pair.network.set_link(pair.server->self(), pair.client->self(), LinkModel{kMs, 0, 0, 50 * kMs, 0});
  ASSERT_TRUE(pair.server->write(delta(2)));
  ASSERT_TRUE(pair.server->write(scheduled(1)));
  pair.run(2 * kMs);
  EXPECT_TRUE(frames(*pair.client).empty());
  EXPECT_EQ(take<ScheduledInputMessage>(*pair.client).size(), 1U);
  pair.run(50 * kMs);
  EXPECT_EQ(frames(*pair.client), range(1, 2));
}

TEST(Simulated, TopicsOvertakeEachOtherButNotThemselves) {
  bool input_first = false;
  bool delta_first = false;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    NetworkOptions options;
    options.seed = seed;
    options.link.jitter_ns = 20 * kMs;
    Pair pair(options);
    ASSERT_TRUE(pair.server->write(scheduled(1)));
    ASSERT_TRUE(pair.server->write(delta(1)));
    for (int step = 0; step < 30; ++step) {
      pair.run(kMs);
      const bool has_delta = !frames(*pair.client).empty();
      const bool has_input = !take<ScheduledInputMessage>(*pair.client).empty();
      if (has_delta != has_input) {
        (has_delta ? delta_first : input_first) = true;
        break;
      }
    }
  }
  EXPECT_TRUE(input_first);
  EXPECT_TRUE(delta_first);
}

TEST(Simulated, WhatKeepLastOverwroteBeforeItsRepairIsGone) {
  NetworkOptions options;
  options.link.repair_ns = 50 * kMs;
  Pair pair(options, 4);
  LinkModel lossy = options.link;
  lossy.loss = 1;
  pair.network.set_all_links(lossy);
  for (Frame frame = 1; frame <= 10; ++frame) ASSERT_TRUE(pair.server->write(delta(frame)));
  pair.network.set_all_links(options.link);
  pair.run(1000 * kMs);
  EXPECT_EQ(frames(*pair.client), range(7, 10));
  EXPECT_EQ(pair.network.counts().overwritten, 6U);
}

TEST(Simulated, AReaderThatDoesNotTakeKeepsTheLastOfEachKey) {
  Pair pair(NetworkOptions{}, 3);
  for (Frame frame = 1; frame <= 10; ++frame) ASSERT_TRUE(pair.server->write(delta(frame)));
  for (Frame applied = 1; applied <= 20; ++applied) {
    ASSERT_TRUE(pair.client->write(ack(1, applied)));
    ASSERT_TRUE(pair.client->write(ack(2, 10 * applied)));
  }
  pair.run(10 * kMs);
  EXPECT_EQ(frames(*pair.client), range(8, 10));
  const auto acks = take<AckMessage>(*pair.server);
  ASSERT_EQ(acks.size(), 2U * 16U);  // the reader's history of acknowledgements, for each client
  EXPECT_EQ(acks[0].message.applied, 5U);
  EXPECT_EQ(acks[1].message.applied, 50U);
  EXPECT_EQ(acks[30].message.applied, 20U);
  EXPECT_EQ(acks[31].message.applied, 200U);
}

TEST(Simulated, TheLossModelCanDropForGood) {
  NetworkOptions options;
  options.link.loss = 0.5;
  options.link.lost_for_good = 1;
  Pair pair(NetworkOptions{});
  pair.network.set_all_links(options.link);
  for (Frame frame = 1; frame <= 100; ++frame) ASSERT_TRUE(pair.server->write(delta(frame)));
  pair.run(1000 * kMs);
  const std::vector<Frame> got = frames(*pair.client);
  EXPECT_EQ(got.size() + pair.network.counts().lost_for_good, 100U);
  EXPECT_GT(pair.network.counts().lost_for_good, 20U);
  EXPECT_TRUE(std::is_sorted(got.begin(), got.end()));
}

TEST(Simulated, AnAnnouncementIsNotLostForGood) {
  NetworkOptions options;
  options.link.loss = 0.9;
  options.link.lost_for_good = 1;
  Pair pair(NetworkOptions{});
  pair.run(1000 * kMs);
  pair.network.set_all_links(options.link);
  ASSERT_TRUE(pair.server->write(session(kEpoch + 1)));
  pair.run(10'000 * kMs);
  std::vector<Received<SessionMessage>> sessions;
  pair.client->take_sessions(sessions);
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].message.epoch, kEpoch + 1);
}

TEST(Simulated, StatusIsBestEffortAndOnlyEverLost) {
  Pair pair(NetworkOptions{});
  LinkModel lossy;
  lossy.loss = 1;
  pair.network.set_all_links(lossy);
  ClientStatusMessage status;
  status.client = 1;
  status.session = "s";
  ASSERT_TRUE(pair.client->write(status));
  pair.run(1000 * kMs);
  EXPECT_EQ(pair.network.counts().repaired, 0U);
}

TEST(Simulated, SamplesThatBreakALimitAreDroppedAndCounted) {
  Pair pair(NetworkOptions{});
  DeltaMessage large = delta(1);
  large.payload.resize(101);
  ASSERT_TRUE(pair.server->write(large));
  ASSERT_TRUE(pair.server->write(delta(2)));
  ASSERT_TRUE(pair.client->write(ack(0, 1)));
  pair.run(100 * kMs);
  EXPECT_EQ(frames(*pair.client), range(2, 2));
  EXPECT_EQ(pair.client->dropped(), 1U);
  EXPECT_TRUE(take<AckMessage>(*pair.server).empty());
  EXPECT_EQ(pair.server->dropped(), 1U);
}

ReplyMessage reply(ClientId client, std::uint64_t highest = 0) {
  ReplyMessage message;
  message.client = client;
  message.highest_input = highest;
  return message;
}

TEST(Simulated, AReplyReachesItsClientAloneOnceThatHasAWriterOfItsOwn) {
  Pair pair(NetworkOptions{});
  const auto other = std::move(*pair.network.make_client("s"));
  ASSERT_TRUE(open_stream(*other, session(), 78));
  pair.run(100 * kMs);
  ASSERT_TRUE(pair.server->write(reply(99)));
  pair.run(100 * kMs);
  EXPECT_EQ(take<ReplyMessage>(*pair.client).size(), 1U);
  EXPECT_EQ(take<ReplyMessage>(*other).size(), 1U) << "a stranger's answer is for everybody";
  ASSERT_TRUE(pair.server->open_client(kClient)) << "twice is harmless";
  ASSERT_TRUE(pair.server->write(reply(kClient, 5)));
  pair.run(100 * kMs);
  const auto own = take<ReplyMessage>(*pair.client);
  ASSERT_EQ(own.size(), 1U) << "also what was written before the match";
  EXPECT_EQ(own[0].message.highest_input, 5U);
  EXPECT_TRUE(take<ReplyMessage>(*other).empty());
}

TEST(Simulated, AClosedReplyWriterHandsNothingToLateReaders) {
  Pair pair(NetworkOptions{});
  pair.server->close_client(kClient);
  ASSERT_TRUE(pair.server->write(reply(kClient, 1)));
  ASSERT_TRUE(pair.server->open_client(kClient));
  ASSERT_TRUE(pair.server->write(reply(kClient, 2)));
  pair.run(100 * kMs);
  take<ReplyMessage>(*pair.client);
  ASSERT_TRUE(open_stream(*pair.client, session(kEpoch + 1)));
  pair.run(100 * kMs);
  const auto kept = take<ReplyMessage>(*pair.client);
  ASSERT_EQ(kept.size(), 1U) << "the answer to the stranger it was is forgotten";
  EXPECT_EQ(kept[0].message.highest_input, 2U);
  pair.server->close_client(kClient);
  pair.server->close_client(kClient);
  ASSERT_TRUE(open_stream(*pair.client, session(kEpoch + 2)));
  pair.run(100 * kMs);
  EXPECT_TRUE(take<ReplyMessage>(*pair.client).empty());
}

TEST(Simulated, OpeningTheStreamForAnotherEpochDropsWhatWasBuffered) {
  Pair pair(NetworkOptions{});
  ASSERT_TRUE(pair.server->write(scheduled(1)));
  ASSERT_TRUE(pair.server->write(delta(1)));
  pair.run(100 * kMs);
  ASSERT_TRUE(open_stream(*pair.client, session(kEpoch + 1)));
  pair.run(100 * kMs);
  EXPECT_TRUE(frames(*pair.client).empty());
  EXPECT_EQ(take<ScheduledInputMessage>(*pair.client).size(), 1U) << "kept by the server for new readers";
}

/// A busy session under every kind of trouble; what everybody received, as text.
std::string busy_hour(std::uint64_t seed) {
  NetworkOptions options;
  options.seed = seed;
  options.link = LinkModel{3 * kMs, 10 * kMs, 0.1, 15 * kMs, 0.05};
  Network network(options);
  const auto server = std::move(*network.make_server("s", 8));
  std::vector<std::unique_ptr<ClientPort>> clients;
  EXPECT_TRUE(server->write(session()));
  std::string log;
  for (Frame frame = 1; frame <= 120; ++frame) {
    if (frame % 20 == 1) {
      clients.push_back(std::move(*network.make_client("s", 8)));
      EXPECT_TRUE(open_stream(*clients.back()));
    }
    if (frame == 50) network.set_frozen(clients[0]->self(), true);
    if (frame == 60) network.set_frozen(clients[0]->self(), false);
    EXPECT_TRUE(server->write(delta(frame)));
    network.advance_to(static_cast<std::int64_t>(frame) * 33 * kMs);
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (i == 0 && frame >= 50 && frame < 60) continue;
      for (const Frame got : frames(*clients[i])) {
        log += std::to_string(i) + ':' + std::to_string(got) + '@' + std::to_string(frame) + ' ';
        EXPECT_TRUE(clients[i]->write(ack(i + 1, got)));
      }
    }
    for (const auto& received : take<AckMessage>(*server)) {
      log += 'a' + std::to_string(received.message.client) + ':' + std::to_string(received.message.applied) +
             ' ';
    }
  }
  return log;
}

TEST(Simulated, TheSameSeedGivesTheSameDeliveriesAndAnotherDoesNot) {
  const std::string first = busy_hour(1);
  EXPECT_EQ(first, busy_hour(1));
  EXPECT_NE(first, busy_hour(2));
}

}  // namespace
}  // namespace tandem::transport::simulated
