// `tandem top`: sessions and clients of a DDS domain, on a screen, as tables or as JSON.

#include <fmt/format.h>
#include <stdio_ext.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_monitor.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/endpoint_options.hpp"
#include "services/tool/top/model/overview.hpp"
#include "services/tool/top/model/status_json.hpp"
#include "services/tool/top/screen/pages.hpp"
#include "services/tool/top/screen/terminal.hpp"

namespace tandem::tool {
namespace {

// Status comes once a second; discovery takes up to as long.
constexpr double kOnceS = 2.5;
constexpr std::size_t kTableColumns = 100;
constexpr std::int64_t kAnnouncementsNs = 2 * kSecond;
constexpr std::chrono::milliseconds kKeysWait(50);

struct TopOptions {
  std::uint32_t domain = 0;
  std::string profile = {};  ///< of the network
  std::string secure;
  NatsFlags nats;
  std::string session;
  double listen_s = kOnceS;
  bool once = false, json = false, stream = false;
};

top::Moment now() { return {.steady_ns = transport::steady_ns(), .wall_ns = transport::wall_ns()}; }

/// Feeds an overview with what a monitor hears.
class Collector {
 public:
  Collector(transport::Monitor& monitor, top::Overview& overview) : monitor_(monitor), overview_(overview) {}

  void collect() {
    servers_.clear();
    clients_.clear();
    monitor_.take(servers_);
    monitor_.take(clients_);
    const top::Moment at = now();
    for (const auto& server : servers_) overview_.update(server, at);
    for (const auto& client : clients_) {
      const bool known = overview_.described(client.message.client);
      overview_.update(client, known ? std::nullopt : monitor_.describe(client.from), at);
    }
    if (at.steady_ns >= announcements_due_ns_) {
      announcements_due_ns_ = at.steady_ns + kAnnouncementsNs;
      sessions_.clear();
      monitor_.list_sessions(sessions_);
      for (const auto& session : sessions_) overview_.update(session.message);
    }
    if (!servers_.empty() || !clients_.empty() || at.steady_ns - aged_ns_ >= kSecond) {
      aged_ns_ = at.steady_ns;
      overview_.age(at);
    }
  }
  /// Announcements are looked at with the next collect().
  void expect_announcements() { announcements_due_ns_ = 0; }

 private:
  transport::Monitor& monitor_;
  top::Overview& overview_;
  std::vector<transport::Stamped<transport::ServerStatusMessage>> servers_;
  std::vector<transport::Stamped<transport::ClientStatusMessage>> clients_;
  std::vector<transport::Received<transport::SessionMessage>> sessions_;
  std::int64_t announcements_due_ns_ = 0, aged_ns_ = 0;
};

/// Returns false if stdout takes no more.
bool print(const top::Overview& overview, const TopOptions& options) {
  const std::string text = options.json || options.stream
                               ? top::to_json(overview, now()) + '\n'
                               : top::print(overview, kTableColumns, now(), top::alphabet_of_locale());
  std::fputs(text.c_str(), stdout);
  return std::fflush(stdout) == 0;
}

/// A reader of stdout that has gone is no failure.
int reader_left() {
  __fpurge(stdout);
  std::clearerr(stdout);
  return 0;
}

/// Prints once, or once a second until the program shall end.
int run_printing(const TopOptions& options, transport::Monitor& monitor, SignalWatch& signals) {
  top::Overview overview;
  if (!options.session.empty()) overview.only(options.session);
  Collector collector(monitor, overview);
  const std::int64_t start_ns = transport::steady_ns();
  std::int64_t shown_ns = start_ns;
  std::string told;
  while (!signals.stop()) {
    monitor.wait(std::chrono::milliseconds(100));
    collector.collect();
    if (std::string trouble = monitor.trouble(); !options.once && trouble != told) {
      told = std::move(trouble);
      if (!told.empty()) fmt::print(stderr, "tandem top: {}\n", told);
    }
    const std::int64_t now_ns = transport::steady_ns();
    if (options.once) {
      if (static_cast<double>(now_ns - start_ns) < options.listen_s * 1e9) continue;
      collector.expect_announcements();
      collector.collect();
      if (const std::string trouble = monitor.trouble(); !trouble.empty())
        fmt::print(stderr, "tandem top: {}\n", trouble);
      return print(overview, options) && !overview.empty() ? 0 : 1;
    }
    if (now_ns - shown_ns >= kSecond) {
      shown_ns += kSecond;
      if (!print(overview, options)) return errno == EPIPE ? reader_left() : 1;
    }
  }
  return 0;
}

/// Draws until the operator ends it, a signal comes or the terminal goes.
int run_screen(const TopOptions& options, transport::Monitor& monitor, const SignalWatch& signals,
               top::Terminal terminal) {
  top::Overview overview;
  if (!options.session.empty()) overview.only(options.session);
  Collector collector(monitor, overview);
  top::View view;
  const top::Alphabet alphabet = top::alphabet_of_locale();
  std::int64_t drawn_ns = 0;
  while (!signals.stop() && terminal.there()) {
    monitor.wait(kKeysWait);
    collector.collect();
    const top::Moment at = now();
    top::Key key = terminal.key();
    if (key == top::Key::kNone && at.steady_ns - drawn_ns < kSecond / 2) continue;
    top::Rows rows = view.rows(overview, at);
    for (; key != top::Key::kNone; key = terminal.key()) {
      if (!view.press(key, rows, terminal.size().lines / 2)) return 0;
      rows = view.rows(overview, at);
    }
    terminal.draw(top::compose(overview, view, rows, options.domain, terminal.size(), at, alphabet));
    drawn_ns = at.steady_ns;
  }
  return 0;
}

Result<std::unique_ptr<transport::Monitor>> open_monitor(const TopOptions& options) {
  if (!options.nats.url.empty()) {
    auto bus = transport::make_nats_bus(options.nats.connection("tandem top"));
    if (!bus) return tl::unexpected(bus.error());
    return std::make_unique<transport::NatsMonitor>(
        transport::NatsPortOptions{.session = {},
                                   .site = options.nats.site,
                                   .client = transport::random_client_id(),
                                   .sender = static_cast<std::uint32_t>(transport::random_client_id()),
                                   .clock = transport::steady_ns},
        transport::wall_ns, options.session, std::move(*bus));
  }
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.secure = options.secure;
  return transport::make_dds_monitor(dds);
}

int run_top(const TopOptions& options) {
  // It is told when the screen is the terminal's again.
  SignalWatch signals("tandem top", SignalWatch::Hangup::kStop,
                      {&transport::dds_fault, [](const std::string&) {}});
  auto monitor = open_monitor(options);
  if (!monitor) {
    fmt::print(stderr, "tandem top: {}\n", monitor.error().message);
    return 1;
  }
  if (options.nats.url.empty()) tell_profile("tandem top", options.domain, options.profile);
  std::signal(SIGPIPE, SIG_IGN);
  std::setlocale(LC_CTYPE, "");
  const int exit_code = [&] {
    if (!options.once && !options.stream) {
      if (auto terminal = top::Terminal::open())
        return run_screen(options, **monitor, signals, std::move(*terminal));
    }
    return run_printing(options, **monitor, signals);
  }();
  if (const std::string why = transport::dds_fault(); !why.empty())
    fmt::print(stderr, "tandem top: {}\n", why);
  return signals.finish(exit_code);
}

}  // namespace

void add_top(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "top", "Shows the sessions and clients of a domain, or of NATS servers, and why a client lags.");
  const auto options = std::make_shared<TopOptions>();
  add_domain_options(command, options->domain, options->profile);
  add_secure_option(command, options->secure);
  add_nats_options(command, options->nats, "whose sessions are shown");
  command.add_option("--session", options->session, "Show only this session (default: all)");
  const commandline::Option once = command.add_flag(
      "--once", options->once, "Listen, print once and stop; exit with 1 if nothing was heard");
  command
      .add_option("--listen", options->listen_s,
                  "How long --once listens, seconds; causes that need more than two reports of a client show "
                  "after some more")
      .range(0.1, 3600.0)
      .show_default()
      .needs(once);
  command.add_flag("--json", options->json, "Print one JSON object: sessions, clients").needs(once);
  command
      .add_flag("--stream", options->stream, "Print a line with a JSON object once a second, until stopped")
      .excludes(once);
  command.footer(
      "On a terminal it is a screen, and ? says which keys it has. Otherwise it prints tables once a second, "
      "until Ctrl-C.");
  command.on_chosen([options, &run] { run = [options] { return run_top(*options); }; });
}

}  // namespace tandem::tool
