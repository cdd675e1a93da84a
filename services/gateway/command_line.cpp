#include "services/gateway/command_line.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/site_name.hpp"
#include "sdk/wire/port.hpp"
#include "services/gateway/doors/admission.hpp"
#include "services/program/commandline/commandline.hpp"
#include "services/program/metrics/probe.hpp"
#include "services/program/process/credential.hpp"

namespace tandem::gateway {
namespace {

/// The folder in which the viewer is installed: as seen from this program, since a tree can be moved, or as
/// it was configured. Empty if it is not installed.
std::string installed_viewer() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  for (const auto& folder : {program.parent_path() / TANDEM_VIEWER_FROM_PROGRAM,
                             std::filesystem::path(TANDEM_VIEWER_INSTALL_DIR)}) {
    if (std::filesystem::exists(folder / "index.html", error)) return folder.lexically_normal().string();
  }
  return "";
}

constexpr std::size_t kMostViewers = 16'384;
constexpr std::size_t kLeastQueueBytes = 64U << 10U, kMostQueueBytes = 1U << 30U;

Result<void> check(const Options& options) {
  if (auto named = transport::check_session_name(options.session); !named) return named;
  if (options.web.tls_cert.empty() != options.web.tls_key.empty())
    return fail(
        ErrorCode::kInvalidArgument,
        options.web.tls_cert.empty()
            ? options.web.tls_key + " has no certificate: --tls-cert, or the systemd credential tls-cert"
            : options.web.tls_cert + " has no key: --tls-key, or the systemd credential tls-key");
  if (!options.secure.empty() && !options.from.empty())
    return fail(ErrorCode::kInvalidArgument,
                "--secure is for DDS; the user of --from nats:// is that of --from-credentials");
  for (const std::string& origin : options.origins) {
    if (auto good = check_origin(origin); !good) return good;
  }
  for (const std::string& proxy : options.web.trusted_proxies) {
    if (!address_key(proxy))
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("--trusted-proxy {}: not an IPv4 or IPv6 address", proxy));
  }
  return {};
}

void add_doors(commandline::Program& app, WebOptions& web) {
  DoorLimits& doors = web.doors;
  app.add_option(
         "--address-connections", doors.connections,
         "Maximum number of connections of one address, which is an IPv4 address or the first 64 bits of an "
         "IPv6 address. A quarter of them may be in a handshake, half may come and twice as many requests may be "
         "made in a second")
      .range(std::size_t{1}, 2 * kMostViewers)
      .show_default();
  app.add_option("--address-joins", doors.joins_per_minute,
                 "Maximum number of viewers that join from one address in a minute")
      .range(1.0, 1e6)
      .show_default();
  app.add_option(
         "--address-bytes", doors.bytes_per_second,
         "Maximum bytes a second of files to one address and messages from it; four times as many at once")
      .range(65'536.0, 1e12)
      .show_default();
  app.add_option("--address-inputs", doors.inputs_per_second,
                 "Maximum number of inputs a second from one address")
      .range(1.0, 1e6)
      .show_default();
  app.add_option(
      "--trusted-proxy", web.trusted_proxies,
      "Address of a proxy; the limits then hold for the last other address in its X-Forwarded-For. "
      "Repeatable");
}

}  // namespace

CommandLine parse_command_line(int argc, const char* const* argv) {
  commandline::Program app{"Serves a session to browsers, over HTTP and WebSocket.", "tandem-gateway"};
  app.version("tandem-gateway " TANDEM_VERSION);
  app.footer(
      "Paths: / the viewer, /tandem the WebSocket, /login takes a token, /healthz the state as JSON. Exit codes: "
      "0 done, 1 failed, 2 wrong usage. SIGINT and SIGTERM stop the gateway cleanly; SIGHUP makes it read tokens, "
      "keys and certificate again.");
  Options options;
  app.add_option("--session", options.session, "Name of the session").show_default();
  auto from = app.add_option(
      "--from", options.from,
      "NATS servers to which a tandem-relay publishes the session, nats:// or tls:// each, divided by commas [DDS]");
  from.check([](const std::string& text) {
    return transport::is_nats_url(text) ? std::string()
                                        : "'" + text + "' does not begin with nats:// or tls://";
  });
  app.add_option("--from-credentials", options.from_credentials,
                 "File of the gateway's NATS user (.creds) [the systemd credential nats, if there is one]")
      .not_empty()
      .needs(from);
  app.add_option("--from-ca", options.from_ca,
                 "File with the authorities that are trusted with --from tls://, PEM [the system's]")
      .not_empty()
      .needs(from);
  options.site = transport::nats::default_site_name();
  app.add_option("--site", options.site,
                 "Name of this site on NATS, which its NATS user is permitted [the host's name]")
      .check(transport::nats::refusal_of_site_name);
  app.add_option(
         "--state", options.state,
         "File in which the session's state is kept, every 10 s. A gateway that is restarted within 15 s goes on "
         "from there, and none of its viewers joins anew [in a unit with a state directory, a file there]")
      .needs(from);
  app.add_option("--domain", options.domain, "DDS domain").range(0U, transport::kMaxDomain).show_default();
  app.add_option("--secure", options.secure,
                 "Folder of the gateway's identity for DDS Security, made by `tandem pki issue gateway`")
      .not_empty();
  app.add_option("--profile", options.profile, transport::kProfileHelp).check([](const std::string& text) {
    return transport::refusal_of_profile(text, transport::Side::kClient);
  });
  app.add_option(
         "--prefer", options.prefer,
         "The stream that all viewers play: a stream's name, or auto, bandwidth, computing or error, as in "
         "`tandem join --help`")
      .show_default();
  app.add_option("--listen", options.web.address,
                 "IPv4 or IPv6 address to listen on; 0.0.0.0 or :: for all addresses of the host")
      .show_default();
  app.add_option("--port", options.web.port, "TCP port; 0 for any free one").range(0, 65535).show_default();
  options.viewer = installed_viewer();
  app.add_option(
      "--viewer", options.viewer,
      "Folder with the viewer's files, which are read once at the start [" TANDEM_VIEWER_INSTALL_DIR
      " if it is installed]");
  app.add_option(
         "--token-key", options.token_keys,
         "File with the public key of tokens that viewers must give, which `tandem pki token` makes with "
         "a role and an expiry. Repeatable [the systemd credential token-key, if there is one]")
      .not_empty();
  app.add_option(
         "--token-file", options.token_file,
         "File whose first line is a token that lets viewers act, without expiry [the systemd credential "
         "token, if there is one]")
      .not_empty();
  app.add_option("--tls-cert", options.web.tls_cert,
                 "Certificate chain, PEM [the systemd credential tls-cert]")
      .not_empty();
  app.add_option("--tls-key", options.web.tls_key, "Its private key, PEM [the systemd credential tls-key]")
      .not_empty();
  app.add_option(
      "--origin", options.origins,
      "Origin whose pages may connect, SCHEME://HOST[:PORT], or * for all; repeatable. Pages that this "
      "gateway served at an IP address may always connect. Listed origins may also show the viewer in a frame");
  std::string metrics;
  app.add_option("--metrics", metrics,
                 "ADDRESS:PORT, or a PORT of 127.0.0.1, to serve metrics for Prometheus at /metrics, and "
                 "/healthz and /readyz")
      .check([](const std::string& text) {
        const auto address = metrics::read_address(text);
        return address ? std::string() : address.error().message;
      });
  std::string question;
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
  app.add_option("--max-viewers", options.limits.viewers, "Maximum number of viewers")
      .range(std::size_t{1}, kMostViewers)
      .show_default();
  app.add_option(
         "--queue-bytes", options.limits.queue_bytes,
         "Maximum bytes of deltas and scheduled inputs that are held for slow viewers; all viewers share "
         "them")
      .range(kLeastQueueBytes, kMostQueueBytes)
      .show_default();
  add_doors(app, options.web);
  if (const auto code = app.parse(argc, argv)) return {.options = std::nullopt, .exit_code = *code};
  if (!question.empty())
    return {.options = std::nullopt, .exit_code = metrics::probe("tandem-gateway", question)};
  if (options.token_file.empty()) options.token_file = credential("token");
  if (!options.from.empty() && options.from_credentials.empty())
    options.from_credentials = credential("nats");
  if (const char* const folder = std::getenv("STATE_DIRECTORY");
      folder != nullptr && options.state.empty() && !options.from.empty())
    options.state = std::string(folder) + "/state";
  if (const std::string key = credential("token-key"); options.token_keys.empty() && !key.empty())
    options.token_keys = {key};
  options.web.origins = options.origins;
  if (options.web.tls_cert.empty() && options.web.tls_key.empty()) {
    options.web.tls_cert = credential("tls-cert");
    options.web.tls_key = credential("tls-key");
  }
  if (const auto good = check(options); !good) {
    std::fputs(fmt::format("tandem-gateway: {}\n", good.error().message).c_str(), stderr);
    return {.options = std::nullopt, .exit_code = 2};
  }
  if (!metrics.empty()) options.metrics = *metrics::read_address(metrics);
  // Each viewer has a second connection for files; the rest are for connections that will be refused.
  options.web.connections = 2 * options.limits.viewers + 64;
  return {.options = std::move(options), .exit_code = 0};
}

}  // namespace tandem::gateway
