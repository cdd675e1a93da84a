// The command line of tandem-relay.
#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "relay.pb.h"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/site_name.hpp"
#include "sdk/wire/port.hpp"
#include "services/program/configuration/command_line.hpp"
#include "services/program/configuration/common.hpp"
#include "services/program/process/credential.hpp"
#include "services/relay/options.hpp"

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

Result<void> check(const RelayOptions& options) {
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

const configuration::Form& form() {
  static const configuration::Form all(*idl::RelayConfig::descriptor());
  return all;
}

tl::unexpected<Error> refuse(const char* flag, const std::string& what) {
  return fail(ErrorCode::kInvalidArgument, fmt::format("--{}: {}", flag, what));
}

/// What systemd hands over, where nothing else is said.
void take_credentials(RelayOptions& options) {
  for (Side* const side : {&options.from, &options.to}) {
    if (!side->is_dds() && side->credentials.empty()) side->credentials = credential("nats");
  }
  if (const char* const folder = std::getenv("STATE_DIRECTORY");
      folder != nullptr && options.state.empty() && !options.from.is_dds() && options.folder.empty())
    options.state = std::string(folder) + "/state";
}

/// Errors: kInvalidArgument, which begins with the flag if it is about one.
Result<RelayOptions> options_of(const idl::RelayConfig& given) {
  idl::RelayConfig config = given;
  configuration::complete(form(), config);
  if (!config.has_from()) return refuse("from", "give the side where the session is");
  if (!config.has_to()) return refuse("to", "give the side where it is published again");
  if (const std::string refusal = refusal_of_side(config.from()); !refusal.empty())
    return refuse("from", refusal);
  if (const std::string refusal = refusal_of_target(config.to()); !refusal.empty())
    return refuse("to", refusal);
  const bool http = config.to() == "http";
  if (http != config.has_dir() || (!http && (config.has_keep() || config.has_keep_mb())))
    return fail(ErrorCode::kInvalidArgument,
                "--to http needs the folder DIR; DIR, --keep and --keep-mb need --to http");
  RelayOptions options;
  options.session = config.session();
  if (config.from() != "dds") options.from.url = config.from();
  if (config.to() != "dds" && !http) options.to.url = config.to();
  options.from.credentials = config.from_credentials();
  options.from.tls_ca = config.from_ca();
  options.to.credentials = config.to_credentials();
  options.to.tls_ca = config.to_ca();
  options.folder = config.dir();
  options.kept.keep_ns = static_cast<std::int64_t>(config.keep() * 1e9);
  options.kept.keep_bytes = static_cast<std::uint64_t>(config.keep_mb() * 1e6);
  options.prefer = config.prefer();
  options.site = config.has_site() ? config.site() : transport::nats::default_site_name();
  if (const std::string refusal = transport::nats::refusal_of_site_name(options.site); !refusal.empty())
    return refuse("site", refusal);
  options.domain = config.domain();
  options.secure = config.secure();
  options.profile = config.profile();
  const std::string refusal = transport::refusal_of_profile(
      options.profile, options.serves_dds() ? transport::Side::kServer : transport::Side::kClient);
  if (!options.profile.empty() && !refusal.empty()) return refuse("profile", refusal);
  options.client_limit = config.max_clients();
  options.state = config.state();
  options.log_bytes = config.log_bytes();
  options.log = configuration::log_of(config);
  auto address = configuration::metrics_of(config);
  if (!address) return tl::unexpected(address.error());
  options.metrics = std::move(*address);
  take_credentials(options);
  return check(options).map([&] { return options; });
}

}  // namespace

configuration::Parsed<RelayOptions> parse_command_line(int argc, const char* const* argv) {
  commandline::Program app{"Passes a session on to other sites, over NATS.", "tandem-relay"};
  app.version("tandem-relay " TANDEM_VERSION);
  app.footer(
      "Beside the server: tandem-relay --from dds --to nats://HUB. At another site: tandem-relay --from nats://HUB "
      "--to dds, for native clients, or tandem-gateway --from nats://HUB, for browsers. Anywhere, for those who only "
      "watch: tandem-relay --from ... --to http DIR, and a web server for the folder. Every frame is checked by "
      "its hash before it is passed on, by this relay or by those who follow it. Exit codes: 0 done, 1 failed, 2 wrong usage. SIGINT and SIGTERM stop it "
      "cleanly. NATS servers: deploy/nats.");
  return configuration::parse(app, "tandem-relay", form(), &options_of, argc, argv);
}

}  // namespace tandem::relay
