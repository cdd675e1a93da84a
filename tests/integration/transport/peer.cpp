// A process for the other side of the DDS tests. Prints lines that the test waits for.
//   transport_peer client DOMAIN SESSION LAST_FRAME: joins, prints "ready", takes deltas up to LAST_FRAME,
//     prints "done first=F last=L missing=M bytes=B".
//   transport_peer server DOMAIN SESSION EPOCH: announces, prints "ready", sends its status until it is
//     killed.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "sdk/transport/dds/dds_ports.hpp"
#include "tests/integration/transport/loopback.hpp"

namespace {

using namespace std::chrono_literals;
using tandem::Frame;
using namespace tandem::transport;

constexpr auto kPatience = 60s;

void say(const std::string& line) {
  std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

int run_client(const DdsOptions& options, Frame last_wanted) {
  const auto port = make_dds_client_port(options);
  if (!port) return 1;
  ClientPort& client = **port;
  const auto end = std::chrono::steady_clock::now() + kPatience;
  std::vector<Received<SessionMessage>> sessions;
  while (sessions.empty()) {
    if (std::chrono::steady_clock::now() > end) return 1;
    client.wait(100ms);
    client.take_sessions(sessions);
  }
  const SessionMessage session = sessions.back().message;
  if (!client.open_stream(session, session.streams[0], options.client) || !client.open_snapshots(0)) return 1;
  if (!client.write(test::an_ack(options.client, session.epoch, 0))) return 1;
  say("ready");
  Frame first = 0;
  Frame last = 0;
  std::uint64_t missing = 0;
  std::uint64_t bytes = 0;
  std::vector<Received<DeltaMessage>> deltas;
  while (last < last_wanted && std::chrono::steady_clock::now() < end) {
    client.wait(100ms);
    deltas.clear();
    client.take(deltas);
    // Repeated, because what is written before the server's reader was matched reaches nobody.
    if (deltas.empty() && !client.write(test::an_ack(options.client, session.epoch, last))) return 1;
    for (const auto& [delta, from] : deltas) {
      if (first == 0) {
        first = delta.frame;
        last = delta.frame - 1;
      }
      missing += delta.frame - last - 1;
      last = delta.frame;
      bytes += delta.payload.size();
      if (!client.write(test::an_ack(options.client, session.epoch, last))) return 1;
    }
  }
  say("done first=" + std::to_string(first) + " last=" + std::to_string(last) +
      " missing=" + std::to_string(missing) + " bytes=" + std::to_string(bytes));
  return 0;
}

int run_server(const DdsOptions& options, tandem::Epoch epoch) {
  const auto port = make_dds_server_port(options);
  if (!port || !(*port)->write(test::a_session(options.session, epoch))) return 1;
  say("ready");
  const auto end = std::chrono::steady_clock::now() + kPatience;
  ServerStatusMessage status;
  status.session = options.session;
  for (int tenths = 0; std::chrono::steady_clock::now() < end; ++tenths) {
    const auto second = static_cast<tandem::Frame>(tenths / 10);
    if (tenths % 10 == 0 && !((*port)->write(status) && (*port)->write(test::a_delta(epoch, second))))
      return 1;
    (*port)->show_life();
    std::this_thread::sleep_for(100ms);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  DdsOptions options;
  options.domain = static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10));
  options.session = argv[3];
  options.client = static_cast<ClientId>(getpid());
  const std::uint64_t number = std::strtoull(argv[4], nullptr, 10);
  const std::string role = argv[1];
  if (role == "client") return run_client(options, number);
  if (role == "server") return run_server(options, number);
  return 2;
}
