// An observer that prints when it applied each frame, for measurements across processes and sites: lines
// "FRAME NANOSECONDS" of the steady clock of this machine, and "joins" for each snapshot that it joined by.

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>

#include "sdk/client/api/clock.hpp"
#include "sdk/client/client_core.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/websocket/websocket_port.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "services/program/commandline/commandline.hpp"

namespace tandem {
namespace {

class Printer final : public client::CoreListener {
 public:
  void on_applied(Epoch /*epoch*/, const client::CompleteDelta& delta) override {
    say(std::to_string(delta.frame) + ' ' + std::to_string(transport::steady_ns()) + '\n');
  }
  void on_snapshot(const transport::SnapshotMessage& /*snapshot*/) override { say("joins\n"); }

 private:
  static void say(const std::string& line) {
    if (write(STDOUT_FILENO, line.data(), line.size()) < 0) std::perror("frame_times");
  }
};

Result<std::unique_ptr<transport::ClientPort>> make_port(std::uint32_t domain, const std::string& session,
                                                         const std::string& url, transport::ClientId id) {
  if (!url.empty()) return transport::make_websocket_client_port({.url = url, .token = {}, .tls_ca = {}});
  transport::DdsOptions dds;
  dds.domain = domain;
  dds.session = session;
  dds.client = id;
  dds.acts = false;
  return transport::make_dds_client_port(dds);
}

int run(std::uint32_t domain, const std::string& session, const std::string& url, const std::string& prefer,
        double seconds) {
  client::CoreOptions options;
  options.session = session;
  options.id = transport::random_client_id();
  options.role = transport::Role::kObserver;
  options.prefer = prefer;
  auto port = make_port(domain, session, url, options.id);
  if (!port) {
    std::fputs((port.error().message + "\n").c_str(), stderr);
    return 1;
  }
  Printer printer;
  client::ClientCore core(std::move(options), **port, &printer);
  const std::int64_t end_ns = transport::steady_ns() + static_cast<std::int64_t>(seconds * 1e9);
  while (transport::steady_ns() < end_ns) {
    const std::int64_t wait_ns = core.poll(client::now()) - transport::steady_ns();
    if (wait_ns > 0) (*port)->wait(std::chrono::nanoseconds(wait_ns));
  }
  return 0;
}

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) {
  tandem::commandline::Program app{"Prints when each frame of a session is applied.", "frame_times"};
  std::uint32_t domain = 0;
  std::string session = "default", url, prefer;
  double seconds = 10;
  app.add_option("--domain", domain, "DDS domain");
  app.add_option("--session", session, "Session name");
  app.add_option("--url", url, "Of a gateway, instead of DDS");
  app.add_option("--prefer", prefer, "The stream");
  app.add_option("--seconds", seconds, "How long it watches");
  if (const auto code = app.parse(argc, argv)) return *code;
  return tandem::run(domain, session, url, prefer, seconds);
}
