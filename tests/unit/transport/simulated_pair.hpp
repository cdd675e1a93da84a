#pragma once
// A session of the smallest messages on the simulated network, for its tests.

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "sdk/transport/simulated/network.hpp"

namespace tandem::transport::simulated {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr Epoch kEpoch = 7;
inline constexpr ClientId kClient = 77;

inline SessionMessage session(Epoch epoch = kEpoch) {
  SessionMessage message;
  message.session = "s";
  message.epoch = epoch;
  message.capacity = 10;
  message.lattice_unit = 1;
  message.types.resize(1);
  message.streams.resize(1);
  message.streams[0].layout.capacity = message.capacity;
  message.streams[0].max_delta_bytes = 100;
  message.streams[0].max_snapshot_bytes = 100;
  return message;
}

inline Result<void> open_stream(ClientPort& port, const SessionMessage& about = session(),
                                ClientId client = kClient) {
  return port.open_stream(about, about.streams[0], client);
}

inline DeltaMessage delta(Frame frame) {
  DeltaMessage message;
  message.epoch = kEpoch;
  message.frame = frame;
  return message;
}

inline ScheduledInputMessage scheduled(std::uint64_t number) {
  ScheduledInputMessage message;
  message.epoch = kEpoch;
  message.number = number;
  return message;
}

inline SnapshotMessage snapshot(Frame frame) {
  SnapshotMessage message;
  message.epoch = kEpoch;
  message.frame = frame;
  message.bytes.resize(1);
  message.total_bytes = 1;
  return message;
}

inline AckMessage ack(ClientId client, Frame applied) {
  AckMessage message;
  message.client = client;
  message.applied = applied;
  return message;
}

template <class M, class Port>
std::vector<Received<M>> take(Port& port) {
  std::vector<Received<M>> out;
  port.take(out);
  return out;
}

inline std::vector<Frame> frames(ClientPort& port) {
  std::vector<Frame> out;
  for (const auto& received : take<DeltaMessage>(port)) out.push_back(received.message.frame);
  return out;
}

inline std::vector<Frame> range(Frame first, Frame last) {
  std::vector<Frame> out;
  for (Frame frame = first; frame <= last; ++frame) out.push_back(frame);
  return out;
}

/// A server and a client that have found each other.
struct Pair {
  explicit Pair(const NetworkOptions& options, std::uint32_t delta_depth = 64)
      : network(options),
        server(std::move(*network.make_server("s", delta_depth))),
        client(std::move(*network.make_client("s", delta_depth))) {
    EXPECT_TRUE(server->write(session()));
    EXPECT_TRUE(open_stream(*client));
    EXPECT_TRUE(client->open_snapshots(0));
    EXPECT_TRUE(server->open_client(kClient));
    run(100 * kMs);
    EXPECT_TRUE(server->joined(client->self(), kClient, 0));
  }
  void run(std::int64_t duration_ns) { network.advance_to(network.now_ns() + duration_ns); }
  Network network;
  std::unique_ptr<ServerPort> server;
  std::unique_ptr<ClientPort> client;
};

}  // namespace tandem::transport::simulated
