// tandem handover: asks the live server of a session to hand over to one that stands by.

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/program/json/json.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/endpoint_options.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {
namespace {

constexpr const char* kName = "tandem handover";
constexpr std::int64_t kFindNs = 5 * kSecond;               // to find the servers
constexpr std::int64_t kHandoverPatienceNs = 20 * kSecond;  // until another server is live
constexpr std::int64_t kRepeatNs = kSecond / 4;

struct HandoverOptions {
  std::uint32_t domain = 0;
  std::string profile = {};  ///< of the network
  std::string secure;
  std::string session = "default";
  bool json = false;
};

int failed(const std::string& why) {
  print_error(fmt::format("{}: {}\n", kName, why));
  return 1;
}

std::uint64_t random_request() {
  std::random_device device;
  return std::uint64_t{device()} << 32U | device();
}

/// The servers of a session, as they are announced.
struct Servers {
  std::optional<transport::SessionMessage> live, standby;  // the standby of the lowest rank
};

Servers look(transport::Monitor& monitor, const std::string& session, Epoch not_before = 0) {
  std::vector<transport::Received<transport::SessionMessage>> all;
  monitor.list_sessions(all);
  Servers found;
  for (auto& [message, from] : all) {
    if (message.session != session) continue;
    auto& place = message.server_role == transport::ServerRole::kLive ? found.live : found.standby;
    const bool live = message.server_role == transport::ServerRole::kLive;
    if (live && message.continues_epoch < not_before) continue;
    if (!place || (!live && message.standby_rank < place->standby_rank)) place = std::move(message);
  }
  return found;
}

int run_handover(const HandoverOptions& options) {
  SignalWatch signals(kName);
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.secure = options.secure;
  auto monitor = transport::make_dds_monitor(dds);
  if (!monitor) return failed(monitor.error().message);
  tell_profile(kName, options.domain, options.profile);
  Servers servers;
  const std::int64_t began_ns = transport::steady_ns();
  while ((!servers.live || !servers.standby) && transport::steady_ns() - began_ns < kFindNs) {
    if (signals.stop()) return signals.finish(1);
    (*monitor)->wait(std::chrono::milliseconds(50));
    servers = look(**monitor, options.session);
  }
  if (!servers.live)
    return signals.finish(
        failed(fmt::format("no live server of session '{}' on domain {}", options.session, options.domain)));
  if (!servers.standby)
    return signals.finish(
        failed(fmt::format("no server stands by for session '{}'; start one with "
                           "tandemd --standby and the same scene",
                           options.session)));
  const Epoch epoch = servers.live->epoch;
  transport::CommandMessage command;
  command.epoch = epoch;
  command.session = options.session;
  command.request = random_request();
  const std::int64_t asked_ns = transport::steady_ns();
  std::int64_t told_ns = INT64_MIN / 2, heard_ns = asked_ns;
  while (transport::steady_ns() - asked_ns < kHandoverPatienceNs && !signals.stop()) {
    const std::int64_t now_ns = transport::steady_ns();
    if (now_ns - told_ns >= kRepeatNs) {  // the server may not be discovered yet
      told_ns = now_ns;
      if (auto sent = (*monitor)->write(command); !sent) return signals.finish(failed(sent.error().message));
    }
    (*monitor)->wait(std::chrono::milliseconds(10));
    const Servers now = look(**monitor, options.session, epoch);
    if (now.standby) heard_ns = now_ns;
    if (now.live && now.live->epoch == epoch && now_ns - heard_ns >= kFindNs)
      return signals.finish(failed("the server that stood by is gone"));
    if (!now.live || now.live->continues_epoch != epoch) continue;
    const double took_s = static_cast<double>(transport::steady_ns() - asked_ns) * 1e-9;
    if (options.json) {
      fmt::print("{}\n", Json{{"session", options.session},
                              {"epoch", now.live->epoch},
                              {"continues_epoch", epoch},
                              {"continues_frame", now.live->continues_frame},
                              {"seconds", took_s}}
                             .dump());
    } else {
      fmt::print("session '{}' is handed over: epoch {} continues epoch {} from frame {}, after {:.1f} s\n",
                 options.session, now.live->epoch, epoch, now.live->continues_frame, took_s);
    }
    return signals.finish(0);
  }
  if (signals.stop()) return signals.finish(failed("stopped; the server may hand over all the same"));
  return signals.finish(
      failed(fmt::format("the server of epoch {} did not hand over within {} s; its log says why", epoch,
                         kHandoverPatienceNs / kSecond)));
}

}  // namespace

void add_handover(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "handover",
      "Asks a session's live server to hand over to a server that stands by (tandemd --standby), for example to "
      "upgrade it.");
  const auto options = std::make_shared<HandoverOptions>();
  command.add_option("session", options->session, "Session").show_default();
  add_domain_options(command, options->domain, options->profile);
  add_secure_option(command, options->secure);
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer(
      "No frame is lost; clients join the other server by themselves. Exits with 1 if there is no server to "
      "hand over, or none that stands by, or if it was not done within 20 s.");
  command.on_chosen([options, &run] { run = [options] { return run_handover(*options); }; });
}

}  // namespace tandem::tool
