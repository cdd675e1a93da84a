#include "services/relay/sides.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <random>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_client_port.hpp"
#include "sdk/transport/nats/nats_server_port.hpp"
#include "sdk/transport/network/reach.hpp"
#include "sdk/transport/secure/identity_folder.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/follow/following/kept_state.hpp"

namespace tandem::relay {
namespace {

transport::DdsOptions dds_options(const RelayOptions& options, const std::atomic<bool>& stop,
                                  const std::shared_ptr<transport::Doorbell>& bell) {
  transport::DdsOptions dds;
  dds.bell = bell;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.session = options.session;
  dds.secure = options.secure;
  dds.stop = &stop;
  return dds;
}

transport::NatsPortOptions nats_options(const RelayOptions& options, transport::ClientId id,
                                        std::uint32_t sender) {
  return {.session = options.session,
          .site = options.site,
          .client = id,
          .sender = sender,
          .clock = transport::steady_ns,
          .log_bytes = options.log_bytes,
          .most_clients = options.client_limit};
}

transport::NatsOptions connection(const Side& side, const std::string& session,
                                  const std::shared_ptr<transport::Doorbell>& bell) {
  return {.url = side.url,
          .name = "tandem-relay " + session,
          .credentials = side.credentials,
          .tls_ca = side.tls_ca,
          .bell = bell};
}

Result<std::unique_ptr<transport::NatsBus>> connect(const Side& side, const std::string& session,
                                                    const std::shared_ptr<transport::Doorbell>& bell) {
  return transport::make_nats_bus(connection(side, session, bell));
}

}  // namespace

Sides::Sides(const RelayOptions& options, const std::atomic<bool>& stop,
             std::shared_ptr<transport::Doorbell> bell)
    : options_(&options), stop_(&stop), bell_(std::move(bell)), sender_(std::random_device()()) {}

Result<void> Sides::check() const {
  if (!options_->secure.empty()) {
    const auto identity =
        transport::secure::check_identity_folder(options_->secure, transport::wall_ns() / kSecond);
    if (!identity) return tl::unexpected(identity.error());
  }
  for (const Side* const side : {&options_->from, &options_->to}) {
    if (side->is_dds()) continue;
    if (auto good = transport::check_nats_files(connection(*side, options_->session, bell_)); !good)
      return good;
  }
  return {};
}

Result<std::unique_ptr<transport::ClientPort>> Sides::follow(transport::ClientId id) {
  if (options_->from.is_dds()) {
    transport::DdsOptions dds = dds_options(*options_, *stop_, bell_);
    dds.client = id;
    dds.every_status = true;  // for monitors behind it
    return transport::make_dds_client_port(dds);
  }
  if (!from_nats_) {
    auto bus = connect(options_->from, options_->session, bell_);
    if (!bus) return tl::unexpected(bus.error());
    from_nats_.emplace(std::move(*bus));
  }
  transport::NatsPortOptions nats = nats_options(*options_, id, sender_);
  if (!kept_.empty()) {
    nats.kept = [this](Epoch epoch, const StreamId& stream) {
      return following::KeptState::find(kept_, epoch, stream);
    };
  }
  return std::make_unique<transport::NatsClientPort>(std::move(nats), from_nats_->share());
}

Result<std::unique_ptr<transport::ServerPort>> Sides::publish(
    const transport::SessionMessage& session) const {
  if (options_->to.is_dds()) {
    transport::DdsOptions dds = dds_options(*options_, *stop_, bell_);
    for (const transport::StreamMessage& stream : session.streams)
      dds.delta_depth = std::max(dds.delta_depth,
                                 transport::delta_depth(session.frame_rate_hz, 24, stream.max_delta_bytes));
    return transport::make_dds_server_port(dds);
  }
  auto bus = connect(options_->to, options_->session, bell_);
  if (!bus) return tl::unexpected(bus.error());
  transport::NatsPortOptions nats = nats_options(*options_, 0, sender_);
  std::random_device random;
  for (std::uint64_t& word : nats.secret) word = std::uint64_t{random()} << 32U | random();
  return std::make_unique<transport::NatsServerPort>(std::move(nats), std::move(*bus));
}

void Sides::tell() const {
  for (const std::string& warning :
       {options_->serves_dds() ? transport::warning_without_security(options_->profile, options_->secure)
                               : "",
        transport::warning_without_tls(options_->from.url), transport::warning_without_tls(options_->to.url)})
    if (!warning.empty()) spdlog::warn("{}", warning);
  const auto name = [this](const Side& side) {
    return side.is_dds() ? fmt::format("DDS domain {}", options_->domain)
                         : transport::without_password(side.url);
  };
  spdlog::info("session '{}' from {} to {}, as site {}", options_->session, name(options_->from),
               options_->folder.empty() ? name(options_->to) : "the folder " + options_->folder,
               options_->site);
  if (!options_->profile.empty())
    spdlog::info("{}", transport::describe_dds_profile(
                           options_->domain, options_->profile,
                           options_->serves_dds() ? transport::Side::kServer : transport::Side::kClient));
}

}  // namespace tandem::relay
