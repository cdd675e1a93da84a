// There is one thread for the session, one for the connections, and a lock around the data that both use.
#include "services/gateway/run.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <thread>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_client_port.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "services/follow/following/kept_state.hpp"
#include "services/gateway/entrance/listener.hpp"
#include "services/gateway/service.hpp"
#include "services/gateway/site.hpp"

namespace tandem::gateway {
namespace {

bool is_loopback(const std::string& address) { return address.starts_with("127.") || address == "::1"; }

/// By what it is told, and not by who can reach it now.
void warn_of_open_access(const GatewayOptions& options) {
  const bool local = is_loopback(options.web.address);
  if (options.token_file.empty() && options.token_keys.empty()) {
    if (local && options.web.trusted_proxies.empty()) return;
    spdlog::warn(
        "there is no --token-key, --token-file or credential: every host that can reach {}{} may watch and send "
        "inputs",
        options.web.address, local ? " through a proxy" : "");
  } else if (options.web.tls_cert.empty() && !local) {
    spdlog::warn("there is no --tls-cert: others on the network can read the token on its way to {}",
                 options.web.address);
  }
  if (const auto warning = transport::warning_without_tls(options.from); !warning.empty())
    spdlog::warn("{}", warning);
}

int report_error(const Error& error, int exit_code) {
  spdlog::error(error.message);
  return exit_code;
}

Result<std::unique_ptr<transport::ClientPort>> make_port(const GatewayOptions& options,
                                                         transport::ClientId id, SignalWatch& signals) {
  if (options.from.empty()) {
    transport::DdsOptions dds;
    dds.domain = options.domain;
    dds.profile = options.profile;
    dds.session = options.session;
    dds.secure = options.secure;
    dds.client = id;
    dds.stop = &signals.stop();
    dds.every_status = true;  // for viewers
    return transport::make_dds_client_port(dds);
  }
  auto bus = transport::make_nats_bus({.url = options.from,
                                       .name = "tandem-gateway " + options.session,
                                       .credentials = options.from_credentials,
                                       .tls_ca = options.from_ca});
  if (!bus) return tl::unexpected(bus.error());
  transport::NatsPortOptions nats{.session = options.session,
                                  .site = options.site,
                                  .client = id,
                                  .sender = static_cast<std::uint32_t>(transport::random_client_id()),
                                  .clock = transport::steady_ns};
  if (!options.state.empty()) {
    nats.kept = [states = following::KeptState(options.state).read()](Epoch epoch, const StreamId& stream) {
      return following::KeptState::find(states, epoch, stream);
    };
  }
  return std::make_unique<transport::NatsClientPort>(std::move(nats), std::move(*bus));
}

}  // namespace

int run(const GatewayOptions& options, SignalWatch& signals) {
  auto secrets = read_secrets(options.token_file, options.token_keys);
  if (!secrets) return report_error(secrets.error(), 2);
  for (const std::string& warning : secrets->warnings) spdlog::warn(warning);
  Site site;
  if (!options.viewer.empty()) {
    auto loaded = Site::load(options.viewer);
    if (!loaded) return report_error(loaded.error(), 2);
    site = std::move(*loaded);
  }
  // By this id `tandem top` knows whose viewers are whose.
  const transport::ClientId id = transport::random_client_id();
  auto port = make_port(options, id, signals);
  if (!port) return report_error(port.error(), port.error().code == ErrorCode::kTransport ? 1 : 2);
  if (options.from.empty() && !options.profile.empty())
    spdlog::info("{}",
                 transport::describe_dds_profile(options.domain, options.profile, transport::Side::kClient));

  Service service(options, std::move(*secrets), id, **port, signals);
  if (options.metrics) {
    if (const auto served = service.serve_metrics(*options.metrics, options.session); !served)
      return signals.finish(report_error(served.error(), 1));
  }
  WebOptions web = options.web;
  web.connections = connections_that_fit(options.web.connections);
  if (web.connections < options.web.connections)
    spdlog::warn("the limit of file descriptors (ulimit -n, LimitNOFILE=) leaves {} of {} connections",
                 web.connections, options.web.connections);
  auto server = WebServer::create(web, site, service);
  if (!server) return signals.finish(report_error(server.error(), 1));
  const bool v6 = options.web.address.find(':') != std::string::npos;
  if (site.empty()) spdlog::warn("{}", kNoPage);
  warn_of_open_access(options);
  spdlog::info("session '{}' {}: {}://{}:{}/", options.session,
               options.from.empty() ? fmt::format("on domain {}", options.domain)
                                    : fmt::format("from {}", transport::without_password(options.from)),
               options.web.tls_cert.empty() ? "http" : "https",
               v6 ? fmt::format("[{}]", options.web.address) : options.web.address, (*server)->port());
  std::jthread follower([&](const std::stop_token& done) { service.follow(done, **server); });
  (*server)->run(signals.stop());
  const int exit_code = signals.finish(0);
  follower.request_stop();
  (*port)->wake();
  follower.join();
  return exit_code;
}

}  // namespace tandem::gateway
