// The command line of tandem-gateway.
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "gateway.pb.h"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/site_name.hpp"
#include "sdk/wire/port.hpp"
#include "services/gateway/entrance/admission.hpp"
#include "services/gateway/options.hpp"
#include "services/program/configuration/command_line.hpp"
#include "services/program/configuration/common.hpp"
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

const configuration::Form& form() {
  static const configuration::Form all(*idl::GatewayConfig::descriptor());
  return all;
}

tl::unexpected<Error> refuse(const char* flag, const std::string& what) {
  return fail(ErrorCode::kInvalidArgument, fmt::format("--{}: {}", flag, what));
}

/// What systemd hands over, where nothing else is said.
void take_credentials(GatewayOptions& options) {
  if (options.token_file.empty()) options.token_file = credential("token");
  if (!options.from.empty() && options.from_credentials.empty())
    options.from_credentials = credential("nats");
  if (const char* const folder = std::getenv("STATE_DIRECTORY");
      folder != nullptr && options.state.empty() && !options.from.empty())
    options.state = std::string(folder) + "/state";
  if (const std::string key = credential("token-key"); options.token_keys.empty() && !key.empty())
    options.token_keys = {key};
  if (options.web.tls_cert.empty() && options.web.tls_key.empty()) {
    options.web.tls_cert = credential("tls-cert");
    options.web.tls_key = credential("tls-key");
  }
}

Result<void> check(const GatewayOptions& options) {
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

/// Errors: kInvalidArgument, which begins with the flag if it is about one.
Result<GatewayOptions> options_of(const idl::GatewayConfig& given) {
  idl::GatewayConfig config = given;
  configuration::complete(form(), config);
  GatewayOptions options;
  options.session = config.session();
  options.from = config.from();
  if (config.has_from() && !transport::is_nats_url(options.from))
    return refuse("from", "'" + options.from + "' does not begin with nats:// or tls://");
  options.from_credentials = config.from_credentials();
  options.from_ca = config.from_ca();
  if (options.from.empty() && (config.has_from_credentials() || config.has_from_ca() || config.has_state()))
    return refuse(config.has_state()     ? "state"
                  : config.has_from_ca() ? "from-ca"
                                         : "from-credentials",
                  "needs --from");
  options.site = config.has_site() ? config.site() : transport::nats::default_site_name();
  if (const std::string refusal = transport::nats::refusal_of_site_name(options.site); !refusal.empty())
    return refuse("site", refusal);
  options.state = config.state();
  options.domain = config.domain();
  options.secure = config.secure();
  options.profile = config.profile();
  if (const std::string refusal = transport::refusal_of_profile(options.profile, transport::Side::kClient);
      !options.profile.empty() && !refusal.empty())
    return refuse("profile", refusal);
  options.prefer = config.prefer();
  options.web.address = config.listen();
  options.web.port = static_cast<std::uint16_t>(config.port());
  options.viewer = config.has_viewer() ? config.viewer() : installed_viewer();
  options.token_keys = {config.token_key().begin(), config.token_key().end()};
  options.token_file = config.token_file();
  options.web.tls_cert = config.tls_cert();
  options.web.tls_key = config.tls_key();
  options.origins = {config.origin().begin(), config.origin().end()};
  options.log = configuration::log_of(config);
  auto address = configuration::metrics_of(config);
  if (!address) return tl::unexpected(address.error());
  options.metrics = std::move(*address);
  options.limits.viewers = config.max_viewers();
  options.limits.queue_bytes = config.queue_bytes();
  options.web.address_limits = {.connections = config.address_connections(),
                                .joins_per_minute = config.address_joins(),
                                .bytes_per_second = config.address_bytes(),
                                .inputs_per_second = config.address_inputs()};
  options.web.trusted_proxies = {config.trusted_proxy().begin(), config.trusted_proxy().end()};
  take_credentials(options);
  options.web.origins = options.origins;
  // Each viewer has a second connection for files; the rest are for connections that will be refused.
  options.web.connections = 2 * options.limits.viewers + 64;
  return check(options).map([&] { return options; });
}

}  // namespace

configuration::Parsed<GatewayOptions> parse_command_line(int argc, const char* const* argv) {
  commandline::Program app{"Serves a session to browsers, over HTTP and WebSocket.", "tandem-gateway"};
  app.version("tandem-gateway " TANDEM_VERSION);
  app.footer(
      "Paths: / the viewer, /tandem the WebSocket, /login takes a token, /healthz the state as JSON. Exit codes: "
      "0 done, 1 failed, 2 wrong usage. SIGINT and SIGTERM stop the gateway cleanly; SIGHUP makes it read tokens, "
      "keys and certificate again.");
  return configuration::parse(app, "tandem-gateway", form(), &options_of, argc, argv);
}

}  // namespace tandem::gateway
