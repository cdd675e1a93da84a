// `tandem join`: headless clients, for tests, measurements and as load.

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <thread>
#include <vector>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/limits.hpp"
#include "services/program/process/heap.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/tool/client_options.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/headless_client.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {
namespace {

constexpr std::uint32_t kMaxCount = 100;  // DDS participants that fit into one domain of one host, roughly

struct JoinOptions {
  HeadlessOptions client;
  std::uint32_t count = 1;
  bool json = false;
};

std::string with_suffix(const std::string& path, std::uint32_t index) {
  return path.empty() ? path : path + "." + std::to_string(index);
}

int run_join(const JoinOptions& options) {
  SignalWatch signals(
      "tandem join", SignalWatch::Hangup::kStop,
      {&transport::dds_fault, [](const std::string& why) { print_error("tandem join: " + why + '\n'); }});
  const HeapTrimmer trimmer;
  std::vector<std::unique_ptr<HeadlessClient>> clients;
  for (std::uint32_t i = 0; i < options.count; ++i) {
    HeadlessOptions one = options.client;
    one.index = i;
    if (options.count > 1) {
      one.hash_log = with_suffix(one.hash_log, i);
      one.capture = with_suffix(one.capture, i);
      one.name = fmt::format("[{}] ", i);
    }
    auto client = HeadlessClient::create(one);
    if (!client) {
      print_error(fmt::format("tandem join: {}\n", client.error().message));
      return signals.finish(1);
    }
    clients.push_back(std::move(*client));
  }
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < clients.size(); ++i) {
      threads.emplace_back([&client = *clients[i], &signals] { client.run(signals.stop()); });
    }
    clients[0]->run(signals.stop());
  }
  if (options.json) {
    Json out;
    if (options.count == 1) {
      out = clients[0]->report();
    } else {
      for (const auto& client : clients) out["clients"].push_back(client->report());
    }
    fmt::print("{}\n", out.dump());
  } else {
    for (const auto& client : clients) fmt::print("{}", client->summary());
  }
  const bool good = std::all_of(clients.begin(), clients.end(), [](const auto& c) { return c->succeeded(); });
  return signals.finish(good ? 0 : 1);
}

}  // namespace

void add_join(commandline::Command app, Run& run) {
  commandline::Command command =
      app.add_subcommand("join", "Joins a session as a client that draws nothing.");
  const auto options = std::make_shared<JoinOptions>();
  HeadlessOptions& client = options->client;
  add_client_options(command, client);
  command.add_flag("--observe", client.observe,
                   "Join as an observer: the server does not wait for this client");
  command
      .add_option("--count", options->count,
                  "Number of clients in this process; log files get the suffix .0, .1, ...")
      .range(1U, kMaxCount)
      .show_default();
  command.add_option("--input-script", client.input_script, "Inputs to send, as protobuf text (InputScript)")
      .existing_file();
  command.add_option("--lead", client.lead, "Frames to simulate beyond the last delta")
      .range(0, 1)
      .show_default();
  command
      .add_option(
          "--max-delay", client.max_delay_s,
          "Seconds for which a gateway may hold back a frame, so that several share a message; without a "
          "gateway, it chooses the offer of the stream (default: 0.2 with --observe, else 0)")
      .range(0.0, 1.0);
  command
      .add_option("--max-kbit-s", client.max_kbit_s,
                  "What this client may take on the network, with all headers (default: no cap)")
      .range(transport::kLeastCapKbitS, transport::kMaxCapKbitS);
  command.add_option("--timeout", client.timeout_s, "Seconds to wait for the first frame (default: for ever)")
      .positive();
  command.add_option("--hash-log", client.hash_log,
                     "File to which a line `epoch,frame,hash` is added for every applied frame");
  command.add_option("--capture", client.capture,
                     "Record into this file, without compression (MCAP; see `tandem record`)");
  command.add_flag(
      "--overwrite", client.overwrite,
      "Replace the file of --capture if it exists; without it, it stays, and the new one gets a number");
  command
      .add_option("--seconds", client.seconds,
                  "Seconds to play, counted from the first applied frame (default: until stopped)")
      .positive();
  command.add_flag("--live", client.live, "Print a JSON line per second on stderr");
  command.add_flag("--json", options->json, "Print the result as one JSON object");
  command.footer(
      "Exits with 1 on any hash mismatch, if it never played, or if no frame came for 5 s before the end though the server neither\nended nor paused.");
  command.on_chosen([options, &run] { run = [options] { return run_join(*options); }; });
}

}  // namespace tandem::tool
