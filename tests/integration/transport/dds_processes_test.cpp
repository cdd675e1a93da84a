// The DDS ports between processes, over loopback: discovery, death, frozen and slow peers.

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <set>
#include <thread>

#include "tests/integration/transport/child.hpp"
#include "tests/integration/transport/loopback.hpp"

namespace tandem::transport {
namespace {

using test::a_delta;
using test::a_session;
using test::Child;
using test::eventually;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr Epoch kEpoch = 1'700'000'000'000;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

class DdsProcesses : public ::testing::Test {
 protected:
  DdsProcesses() : options_(test::loopback()) {}

  std::unique_ptr<Child> peer(const std::string& role, std::uint64_t number) const {
    return std::make_unique<Child>(std::vector<std::string>{
        TANDEM_TEST_PEER, role, std::to_string(options_.domain), options_.session, std::to_string(number)});
  }
  std::unique_ptr<ServerPort> server() {
    auto port = make_dds_server_port(options_);
    EXPECT_TRUE(port) << (port ? "" : port.error().message);
    EXPECT_TRUE((*port)->write(a_session(options_.session, kEpoch)));
    return std::move(*port);
  }
  /// Waits for `count` more peers that were started as clients; who they are, in the order of their
  /// acknowledgements.
  std::vector<ParticipantId> joined(ServerPort& server, std::size_t count) {
    std::vector<ParticipantId> ids;
    EXPECT_TRUE(eventually(
        [&] {
          server.wait(1ms);
          std::vector<Received<AckMessage>> acks;
          server.take(acks);
          for (const auto& ack : acks) {
            if (!known_.insert(ack.from).second) continue;
            ids.push_back(ack.from);
            clients_[ack.from] = ack.message.client;
            EXPECT_TRUE(server.open_client(ack.message.client));
          }
          return ids.size() == count && std::all_of(ids.begin(), ids.end(), [&](const ParticipantId& id) {
                   return server.joined(id, clients_.at(id), 0) && server.alive(id);
                 });
        },
        30s))
        << ids.size() << " of " << count;
    return ids;
  }
  /// Writes frames first..last at the session's pace; the longest write in ms.
  static double write_frames(ServerPort& server, Frame first, Frame last, std::size_t size,
                             std::chrono::nanoseconds pace = 33'333'333ns) {
    double longest_ms = 0;
    auto next = Clock::now();
    for (Frame frame = first; frame <= last; ++frame) {
      const auto start = Clock::now();
      EXPECT_TRUE(server.write(a_delta(kEpoch, frame, size)));
      longest_ms = std::max(longest_ms, ms_since(start));
      next += pace;
      std::this_thread::sleep_until(next);
    }
    return longest_ms;
  }
  static std::string complete(Frame first, Frame last, std::size_t size) {
    return "done first=" + std::to_string(first) + " last=" + std::to_string(last) +
           " missing=0 bytes=" + std::to_string((last - first + 1) * size);
  }

  DdsOptions options_;
  std::set<ParticipantId> known_;
  std::map<ParticipantId, ClientId> clients_;
};

TEST_F(DdsProcesses, EveryDeltaAfterJoinedArrivesInTheOtherProcess) {
  const auto server = this->server();
  for (int attempt = 0; attempt < 5; ++attempt) {
    const auto start = Clock::now();
    const auto client = peer("client", 50);
    ASSERT_EQ(client->line(), "ready");
    std::vector<ParticipantId> ids = joined(*server, 1);
    std::cout << "joined " << ms_since(start) << " ms after its start\n";
    write_frames(*server, 1, 50, 6000, 1ms);
    EXPECT_EQ(client->line(), complete(1, 50, 6000));
  }
}

TEST_F(DdsProcesses, DeltasOf240KilobytesAt30HertzArriveCompletely) {
  const auto server = this->server();
  const auto client = peer("client", 90);
  ASSERT_EQ(client->line(), "ready");
  joined(*server, 1);
  const double longest_ms = write_frames(*server, 1, 90, 240'000);
  EXPECT_EQ(client->line(), complete(1, 90, 240'000));
  std::cout << "longest write " << longest_ms << " ms\n";
}

TEST_F(DdsProcesses, AFrozenReaderNeitherDelaysNorLosesAnythingForAnother) {
  const auto server = this->server();
  const auto frozen = peer("client", 100'000);
  ASSERT_EQ(frozen->line(), "ready");
  const auto healthy = peer("client", 150);
  ASSERT_EQ(healthy->line(), "ready");
  joined(*server, 2);
  write_frames(*server, 1, 10, 64'000);
  frozen->signal(SIGSTOP);
  const double longest_ms = write_frames(*server, 11, 150, 64'000);
  EXPECT_EQ(healthy->line(), complete(1, 150, 64'000));
  std::cout << "longest write beside a frozen reader " << longest_ms << " ms\n";
  frozen->signal(SIGCONT);
}

TEST_F(DdsProcesses, AReaderThatWasFrozenHearsTheServerAgain) {
  const auto server = this->server();
  const auto client = peer("client", 61);
  ASSERT_EQ(client->line(), "ready");
  const ParticipantId id = joined(*server, 1).at(0);
  client->signal(SIGSTOP);
  const auto start = Clock::now();
  EXPECT_TRUE(eventually([&] { return !server->alive(id); }));
  std::cout << "silence noticed after " << ms_since(start) << " ms\n";
  write_frames(*server, 1, 60, 6000, 10ms);
  client->signal(SIGCONT);
  EXPECT_TRUE(eventually([&] { return server->alive(id); }));
  write_frames(*server, 61, 61, 6000);
  EXPECT_EQ(client->line(), complete(1, 61, 6000)) << "64 deltas are kept";
}

TEST_F(DdsProcesses, AKilledClientIsNoticed) {
  const auto server = this->server();
  const auto client = peer("client", 100'000);
  ASSERT_EQ(client->line(), "ready");
  const ParticipantId id = joined(*server, 1).at(0);
  client->signal(SIGKILL);
  const auto start = Clock::now();
  EXPECT_TRUE(eventually([&] { return !server->alive(id); }));
  std::cout << "noticed after " << ms_since(start) << " ms\n";
}

TEST_F(DdsProcesses, AKilledServerIsNoticedAndTheNextOneIsFound) {
  auto port = make_dds_client_port(options_);
  ASSERT_TRUE(port);
  ClientPort& client = **port;
  std::vector<Received<SessionMessage>> sessions;
  const auto sees = [&](Epoch epoch) {
    return eventually([&] {
      client.take_sessions(sessions);
      return !sessions.empty() && sessions.back().message.epoch == epoch;
    });
  };
  auto server = peer("server", kEpoch);
  ASSERT_TRUE(sees(kEpoch));
  ASSERT_TRUE(client.open_stream(sessions.back().message, sessions.back().message.streams[0], 77));
  EXPECT_TRUE(client.server_alive());
  server->signal(SIGKILL);
  auto start = Clock::now();
  EXPECT_TRUE(eventually([&] { return !client.server_alive(); }));
  std::cout << "noticed after " << ms_since(start) << " ms\n";
  start = Clock::now();
  server = peer("server", kEpoch + 1);
  EXPECT_TRUE(sees(kEpoch + 1));
  std::cout << "next server found " << ms_since(start) << " ms after its start\n";
  ASSERT_TRUE(client.open_stream(sessions.back().message, sessions.back().message.streams[0], 77));
  EXPECT_TRUE(client.server_alive());
}

TEST_F(DdsProcesses, AServerThatWasStoppedIsReportedAgain) {
  auto port = make_dds_client_port(options_);
  ASSERT_TRUE(port);
  ClientPort& client = **port;
  std::vector<Received<SessionMessage>> sessions;
  const auto server = peer("server", kEpoch);
  const auto reported = [&] {
    client.take_sessions(sessions);
    return !sessions.empty();
  };
  ASSERT_TRUE(eventually(reported));
  ASSERT_TRUE(client.open_stream(sessions.back().message, sessions.back().message.streams[0], 77));
  std::this_thread::sleep_for(500ms);  // so that it shows life once
  server->signal(SIGSTOP);
  EXPECT_TRUE(eventually([&] { return !client.server_alive(); }));
  sessions.clear();
  client.take_sessions(sessions);
  EXPECT_TRUE(sessions.empty());
  server->signal(SIGCONT);
  EXPECT_TRUE(eventually(reported));
  EXPECT_TRUE(client.server_alive());
}

TEST_F(DdsProcesses, SixteenProcessesFindEachOtherWithoutMulticast) {
  setenv("CYCLONEDDS_URI",
         "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface "
         "name=\"lo\"/></Interfaces></General>"
         "</Domain></CycloneDDS>",
         1);
  const auto server = this->server();
  std::vector<std::unique_ptr<Child>> clients;
  for (int i = 0; i < 15; ++i) clients.push_back(peer("client", 30));
  for (const auto& client : clients) ASSERT_EQ(client->line(), "ready");
  joined(*server, clients.size());
  write_frames(*server, 1, 30, 6000, 10ms);
  for (const auto& client : clients) EXPECT_EQ(client->line(), complete(1, 30, 6000));
}

}  // namespace
}  // namespace tandem::transport
