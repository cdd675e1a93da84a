#pragma once
// A server's and a client's DDS port within one process, over loopback.

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "sdk/transport/dds/node.hpp"
#include "tests/integration/transport/loopback.hpp"

namespace tandem::transport {

using test::a_delta;
using test::a_session;
using test::eventually;
using namespace std::chrono_literals;

inline constexpr Epoch kEpoch = 1'700'000'000'000;
inline constexpr ClientId kClient = 77;

class DdsPorts : public ::testing::Test {
 protected:
  DdsPorts() : options_(test::loopback()) {}

  std::unique_ptr<ServerPort> server() {
    auto port = make_dds_server_port(options_);
    EXPECT_TRUE(port) << (port ? "" : port.error().message);
    return port ? std::move(*port) : nullptr;
  }
  std::unique_ptr<ClientPort> client() {
    auto port = make_dds_client_port(options_);
    EXPECT_TRUE(port) << (port ? "" : port.error().message);
    return port ? std::move(*port) : nullptr;
  }
  /// Announces, opens everything and waits until the server sees all of it.
  SessionMessage join(ServerPort& server, ClientPort& client) {
    const SessionMessage session = a_session(options_.session, kEpoch);
    EXPECT_TRUE(server.write(session));
    EXPECT_TRUE(client.open_stream(session, session.streams[0], kClient));
    EXPECT_TRUE(client.open_snapshots(0));
    EXPECT_TRUE(server.open_client(kClient));
    EXPECT_TRUE(eventually([&] {
      return server.joined(client.self(), kClient, 0) && server.alive(client.self()) &&
             server.acts(client.self());
    }));
    return session;
  }
  /// The next `count` messages of a type.
  template <class M, class Port>
  std::vector<Received<M>> receive(Port& port, std::size_t count) {
    std::vector<Received<M>> out;
    EXPECT_TRUE(eventually([&] {
      port.wait(1ms);
      port.take(out);
      return out.size() >= count;
    })) << "got "
        << out.size() << " of " << count;
    return out;
  }
  /// A reader drops what comes before the first heartbeat of a writer that is new to it.
  void write_until_received(ServerPort& server, ClientPort& client, const SnapshotMessage& snapshot) {
    std::vector<Received<SnapshotMessage>> got;
    ASSERT_TRUE(eventually([&] {
      EXPECT_TRUE(server.write(kClient, snapshot));
      client.wait(100ms);
      client.take(got);
      return !got.empty();
    }));
    EXPECT_EQ(got[0].message, snapshot);
  }
  template <class Port>
  std::vector<Received<SessionMessage>> receive_sessions(Port& port, std::size_t count = 1) {
    std::vector<Received<SessionMessage>> out;
    EXPECT_TRUE(eventually([&] {
      out.clear();
      port.take_sessions(out);
      return out.size() >= count;
    }));
    return out;
  }

  DdsOptions options_;
};

}  // namespace tandem::transport
