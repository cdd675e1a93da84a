#include "services/relay/command_line.hpp"

#include <fmt/format.h>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/site_name.hpp"
#include "sdk/wire/port.hpp"
#include "services/program/commandline/commandline.hpp"
#include "services/program/metrics/probe.hpp"
#include "services/program/process/credential.hpp"

namespace tandem::relay {
namespace {

std::string refusal_of_side(const std::string& text) {
  if (text == "dds" || transport::is_nats_url(text)) return {};
  return fmt::format("'{}' is neither dds nor an address that begins with nats:// or tls://", text);
}

std::string refusal_of_target(const std::string& text) {
  if (text == "http" || refusal_of_side(text).empty()) return {};
  return fmt::format("'{}' is neither dds, nor http, nor an address that begins with nats:// or tls://",
                     text);
}

Result<void> check(const Options& options) {
  if (auto named = transport::check_session_name(options.session); !named) return named;
  if (options.from.is_dds() && options.to.is_dds() && options.folder.empty())
    return fail(ErrorCode::kInvalidArgument, "--from and --to are both dds: one side is NATS");
  if (!options.state.empty() && (options.from.is_dds() || !options.folder.empty()))
    return fail(ErrorCode::kInvalidArgument, "--state is for --from nats:// and --to dds or nats://");
  if (!options.secure.empty() && !options.from.is_dds() && !options.serves_dds())
    return fail(ErrorCode::kInvalidArgument, "--secure is for a side that is dds");
  for (const Side* const side : {&options.from, &options.to}) {
    if (side->is_dds() && !(side->credentials.empty() && side->tls_ca.empty()))
      return fail(ErrorCode::kInvalidArgument,
                  "credentials and authorities of NATS are for a side that is NATS");
  }
  return {};
}

void add_side(commandline::Program& app, const std::string& flag, const std::string& help, std::string& text,
              Side& side, std::string (*refusal)(const std::string&)) {
  app.add_option("--" + flag, text, help).check(refusal).required();
  app.add_option("--" + flag + "-credentials", side.credentials,
                 "File of a NATS user (.creds) for that side [the systemd credential nats, if there is one]")
      .not_empty();
  app.add_option("--" + flag + "-ca", side.tls_ca,
                 "File with the authorities that are trusted on that side, PEM [the system's]")
      .not_empty();
}

}  // namespace

CommandLine parse_command_line(int argc, const char* const* argv) {
  commandline::Program app{"Passes a session on to other sites, over NATS.", "tandem-relay"};
  app.version("tandem-relay " TANDEM_VERSION);
  app.footer(
      "Beside the server: tandem-relay --from dds --to nats://HUB. At another site: tandem-relay --from nats://HUB "
      "--to dds, for native clients, or tandem-gateway --from nats://HUB, for browsers. Anywhere, for those who only "
      "watch: tandem-relay --from ... --to http DIR, and a web server for the folder. Every frame is checked by "
      "its hash before it is passed on, by this relay or by those who follow it. Exit codes: 0 done, 1 failed, 2 wrong usage. SIGINT and SIGTERM stop it "
      "cleanly. NATS servers: deploy/nats.");
  Options options;
  options.site = transport::nats::default_site_name();
  std::string from, to, metrics, question;
  std::optional<double> keep_s, keep_mb;
  app.add_option("--session", options.session, "Session name").show_default();
  add_side(app, "from",
           "Where the session is: dds, or the NATS servers of the relay before this one, divided by commas",
           from, options.from, refusal_of_side);
  add_side(app, "to", "Where it is published again: dds, NATS servers, or http, with DIR", to, options.to,
           refusal_of_target);
  app.add_option("dir", options.folder,
                 "With --to http: the folder that a web server serves to an audience (idl/AUDIENCE.md)");
  app.add_option(
         "--keep", keep_s,
         "With --to http: seconds of the session that stay to be played; older files are removed [all]")
      .positive();
  app.add_option("--keep-mb", keep_mb,
                 "With --to http: megabytes that the folder may have; older files are removed [all]")
      .positive();
  app.add_option(
         "--prefer", options.prefer,
         "With --to http: the stream that is published, `bandwidth`, `error`, `computing` or its name")
      .show_default();
  app.add_option("--site", options.site,
                 "Name of this site on NATS, which its NATS user is permitted [the host's name]")
      .check(transport::nats::refusal_of_site_name);
  app.add_option("--domain", options.domain, "DDS domain of the side that is dds")
      .range(0U, transport::kMaxDomain)
      .show_default();
  app.add_option("--profile", options.profile, transport::kProfileHelp);
  app.add_option(
         "--secure", options.secure,
         "Folder of this program's identity for DDS Security, made by `tandem pki issue`: a client's with "
         "--from dds, a server's with --to dds")
      .not_empty();
  app.add_option("--max-clients", options.client_limit, "Maximum number of clients that play here")
      .range(1U, 4096U)
      .show_default();
  app.add_option(
      "--state", options.state,
      "With --from nats://: file in which the session's state is kept, every 10 s. A relay that is "
      "restarted within 15 s goes on from there, and none of its clients joins anew [in a unit with a "
      "state directory, a file there]");
  app.add_option("--log-bytes", options.log_bytes,
                 "With --to nats://: maximum bytes of deltas that are kept, for 30 s, for who lost them")
      .range(std::size_t{1} << 20U, std::size_t{1} << 30U)
      .show_default();
  app.add_option("--metrics", metrics,
                 "ADDRESS:PORT, or a PORT of 127.0.0.1, to serve metrics for Prometheus at /metrics, and "
                 "/healthz and /readyz")
      .check([](const std::string& text) {
        const auto address = metrics::read_address(text);
        return address ? std::string() : address.error().message;
      });
  app.add_option("--probe", question, metrics::kProbeHelp);
  app.add_choice("--log-format", options.log.format,
                 {{"text", logging::Format::kText}, {"json", logging::Format::kJson}},
                 "How lines of the log look: for people and journald, or one JSON object each [text]");
  app.add_choice("--log-level", options.log.level,
                 {{"error", logging::Level::kError},
                  {"warning", logging::Level::kWarning},
                  {"info", logging::Level::kInfo},
                  {"debug", logging::Level::kDebug}},
                 "The least urgent lines that are logged [info]");
  // A probe needs no sides.
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::string(argv[i]) == "--probe")
      return {.options = std::nullopt, .exit_code = metrics::probe("tandem-relay", argv[i + 1])};
  }
  if (const auto code = app.parse(argc, argv)) return {.options = std::nullopt, .exit_code = *code};
  if (from != "dds") options.from.url = from;
  if (to != "dds" && to != "http") options.to.url = to;
  if ((to == "http") == options.folder.empty() || (to != "http" && (keep_s || keep_mb))) {
    std::fputs("tandem-relay: --to http needs the folder DIR; DIR, --keep and --keep-mb need --to http\n",
               stderr);
    return {.options = std::nullopt, .exit_code = 2};
  }
  options.kept.keep_ns = static_cast<std::int64_t>(keep_s.value_or(0) * 1e9);
  options.kept.keep_bytes = static_cast<std::uint64_t>(keep_mb.value_or(0) * 1e6);
  for (Side* const side : {&options.from, &options.to}) {
    if (!side->is_dds() && side->credentials.empty()) side->credentials = credential("nats");
  }
  if (const char* const folder = std::getenv("STATE_DIRECTORY");
      folder != nullptr && options.state.empty() && !options.from.is_dds() && options.folder.empty())
    options.state = std::string(folder) + "/state";
  auto good = check(options);
  if (good && !options.profile.empty()) {
    const std::string refusal = transport::refusal_of_profile(
        options.profile, options.serves_dds() ? transport::Side::kServer : transport::Side::kClient);
    if (!refusal.empty()) good = fail(ErrorCode::kInvalidArgument, refusal);
  }
  if (!good) {
    std::fputs(fmt::format("tandem-relay: {}\n", good.error().message).c_str(), stderr);
    return {.options = std::nullopt, .exit_code = 2};
  }
  if (!metrics.empty()) options.metrics = *metrics::read_address(metrics);
  return {.options = std::move(options), .exit_code = 0};
}

}  // namespace tandem::relay
