#include "services/relay/relay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "services/relay/relay_source.hpp"

namespace tandem::relay {

Relay::Relay(Options options, Upstream& upstream, MakePort make_port, Publishing& publishing)
    : options_(std::move(options)),
      upstream_(&upstream),
      make_port_(std::move(make_port)),
      publishing_(&publishing) {}

void Relay::close() {
  if (!host_) return;
  publishing_->closing();
  host_.reset();
  port_.reset();
  upstream_->forget_inputs();
}

void Relay::give_up(const std::string& why) {
  if (why != std::exchange(told_, why)) log(LogLevel::kError, why);
  close();
  retry_ns_ = now_.steady_ns + options_.retry_ns;
}

void Relay::open() {
  TANDEM_ASSERT(!host_);
  const transport::SessionMessage& session = *upstream_->session();
  for (std::uint32_t id = 0; id < session.streams.size(); ++id) {
    if (session.streams[id].id != StreamId{id, 0})
      return give_up(
          fmt::format("stream {} of the session has id {} and generation {}, which this relay cannot pass on",
                      id, session.streams[id].id.id, session.streams[id].id.generation));
  }
  auto port = make_port_(session);
  if (!port) return give_up(port.error().message);
  port_ = std::move(*port);
  host::ServiceConfig config = RelaySource::config_of(session);
  config.client_limit = options_.client_limit;
  config.participant_limit = options_.participant_limit;
  config.claim_ns = options_.claim_ns;
  config.clock_ns = options_.clock_ns;
  auto host = host::Host::create(config, std::make_unique<RelaySource>(*upstream_), *port_);
  if (!host) {
    port_.reset();
    return give_up(host.error().message);
  }
  host_ = std::move(*host);
  ++opened_;
  publishing_->opened(*host_, *port_);
  log(LogLevel::kInfo, fmt::format("passes on session '{}', epoch {}, from frame {}", session.session,
                                   session.epoch, host_->frame()));
}

std::int64_t Relay::poll(client::Now now) {
  now_ = now;
  std::int64_t due_ns = upstream_->poll(now);
  const transport::SessionMessage* const session = upstream_->session();
  const Feed& first = upstream_->first();
  if (first.server_alive()) heard_ns_ = now.steady_ns;
  if (host_ && session != nullptr && session->epoch != host_->session().epoch) {
    log(LogLevel::kInfo, "the server began anew");
    close();
  }
  if (host_ && now.steady_ns - heard_ns_ > kGoneNs) {
    log(LogLevel::kWarning, "the server has not been heard for 40 s: the session ends here");
    close();
  }
  const bool can =
      session != nullptr && first.playing() && first.epoch() == session->epoch && first.server_alive();
  if (stands_by_ && (!host_ || host_->state() == host::Host::State::kClaiming)) upstream_->stand_by(kKeptNs);
  if (!host_ && can && now.steady_ns >= retry_ns_) open();
  obstacle_ = session == nullptr                               ? "it looks for the session"
              : stands_by_ && first.playing()                  ? nullptr
              : !host_                                         ? "it does not publish the session"
              : !first.playing()                               ? "it joins the session"
              : host_->state() == host::Host::State::kClaiming ? "it looks for another server of the session"
                                                               : nullptr;
  if (host_) due_ns = std::min(due_ns, poll_host());
  upstream_->prepare();
  return due_ns;
}

std::int64_t Relay::poll_host() {
  for (int i = 0; i < kFramesPerPoll && host_->poll(now_.steady_ns, now_.wall_ns); ++i) {
  }
  for (const std::string& notice : host_->take_notices()) log(LogLevel::kInfo, notice);
  if (host_->state() == host::Host::State::kRefused || host_->state() == host::Host::State::kEnded) {
    stands_by_ = host_->error() && host_->error()->code == ErrorCode::kConflict;
    give_up(host_->error() ? host_->error()->message : "the session ended");
    return retry_ns_;
  }
  if (host_->state() != host::Host::State::kClaiming) {
    told_.clear();
    stands_by_ = false;
  }
  if (const std::string why = publishing_->failure(); !why.empty()) {
    give_up(why);
    return retry_ns_;
  }
  return host_->next_wake_ns();
}

}  // namespace tandem::relay
