// `tandem top`: sessions and clients of a DDS domain, from their status topics.

#include <fmt/format.h>
#include <stdio_ext.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <memory>
#include <vector>

#include "sdk/transport/clock.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/units.hpp"
#include "services/process/signal_watch.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/endpoint_options.hpp"
#include "services/tool/top_view.hpp"

namespace tandem::tool {
namespace {

// Status comes once a second; discovery takes up to as long.
constexpr std::int64_t kOnceNs = 5 * kSecond / 2;

struct TopOptions {
  std::uint32_t domain = 0;
  std::string profile = {};  ///< of the network
  std::string secure;
  std::string session;
  bool once = false, json = false, stream = false;
};

void collect(transport::Monitor& monitor, TopView& view) {
  std::vector<transport::Received<transport::ServerStatusMessage>> servers;
  std::vector<transport::Received<transport::ClientStatusMessage>> clients;
  monitor.take(servers);
  monitor.take(clients);
  const std::int64_t now_ns = transport::steady_ns();
  for (const auto& server : servers) view.update(server.message, now_ns);
  for (const auto& client : clients) view.update(client.message, now_ns);
  view.forget_silent(now_ns);
}

/// Returns false if stdout takes no more.
bool show(const TopView& view, const TopOptions& options) {
  const bool screen = !options.once && !options.stream && ::isatty(STDOUT_FILENO) != 0;
  if (screen) std::fputs("\x1b[H\x1b[2J", stdout);
  std::fputs(options.json || options.stream ? (view.to_json() + '\n').c_str() : view.to_table().c_str(),
             stdout);
  return std::fflush(stdout) == 0;
}

/// A reader of stdout that has gone is no failure.
int reader_left() {
  __fpurge(stdout);
  std::clearerr(stdout);
  return 0;
}

int run_top(const TopOptions& options) {
  SignalWatch signals("tandem top");
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.secure = options.secure;
  auto monitor = transport::make_dds_monitor(dds);
  if (!monitor) {
    fmt::print(stderr, "tandem top: {}\n", monitor.error().message);
    return 1;
  }
  tell_profile("tandem top", options.domain, options.profile);
  std::signal(SIGPIPE, SIG_IGN);
  TopView view;
  if (!options.session.empty()) view.only(options.session);
  const std::int64_t start_ns = transport::steady_ns();
  std::int64_t shown_ns = start_ns;
  while (!signals.stop()) {
    (*monitor)->wait(std::chrono::milliseconds(100));
    collect(**monitor, view);
    const std::int64_t now_ns = transport::steady_ns();
    if (options.once) {
      if (now_ns - start_ns < kOnceNs) continue;
      return signals.finish(show(view, options) && !view.empty() ? 0 : 1);
    }
    if (now_ns - shown_ns >= kSecond) {
      shown_ns += kSecond;
      if (!show(view, options)) return signals.finish(errno == EPIPE ? reader_left() : 1);
    }
  }
  return signals.finish(0);
}

}  // namespace

void add_top(commandline::Command app, Run& run) {
  commandline::Command command =
      app.add_subcommand("top", "Shows the sessions and clients of a domain, their bandwidth and lag.");
  const auto options = std::make_shared<TopOptions>();
  add_domain_options(command, options->domain, options->profile);
  add_secure_option(command, options->secure);
  command.add_option("--session", options->session, "Show only this session (default: all)");
  const commandline::Option once = command.add_flag(
      "--once", options->once, "Listen for 2.5 s, print once and stop; exit with 1 if nothing was heard");
  command.add_flag("--json", options->json, "Print one JSON object: sessions, clients").needs(once);
  command
      .add_flag("--stream", options->stream, "Print a line with a JSON object once a second, until stopped")
      .excludes(once);
  command.footer("Without flags, shows a table that is refreshed once a second, until Ctrl-C.");
  command.on_chosen([options, &run] { run = [options] { return run_top(*options); }; });
}

}  // namespace tandem::tool
