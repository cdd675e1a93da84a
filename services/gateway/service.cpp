#include "services/gateway/service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <array>
#include <chrono>
#include <utility>

#include "sdk/client/api/clock.hpp"
#include "sdk/wire/clock.hpp"
#include "services/program/json/json.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/metrics/reasons.hpp"

namespace tandem::gateway {
namespace {

using transport::steady_ns;
using transport::wall_s;

/// What a viewer's inputs became is told once in this time.
constexpr std::int64_t kDeedsNs = 10 * kSecond;

Refusal refusal_of(tokens::Denial denial) {
  switch (denial) {
    case tokens::Denial::kExpired:
      return Refusal::kTokenExpired;
    case tokens::Denial::kEarly:
      return Refusal::kTokenEarly;
    case tokens::Denial::kRole:
      return Refusal::kTokenRole;
    case tokens::Denial::kSession:
      return Refusal::kTokenSession;
    case tokens::Denial::kWrong:
      break;
  }
  return Refusal::kToken;
}

client::CoreOptions core_options(const GatewayOptions& options, transport::ClientId id) {
  client::CoreOptions core;
  core.session = options.session;
  core.prefer = options.prefer;
  core.max_delay_ms = 0;  // it collects for each viewer itself
  core.id = id;
  core.log = logging::write;
  core.measure_ns = steady_ns;
  return core;
}

std::string_view phase_name(ClientPhase phase) {
  constexpr std::array<std::string_view, 4> kNames{"searching", "refused", "joining", "playing"};
  return kNames[static_cast<std::size_t>(phase)];
}

}  // namespace

Service::Service(const GatewayOptions& options, Secrets secrets, transport::ClientId id,
                 transport::ClientPort& port, SignalWatch& signals)
    : options_(options),
      port_(port),
      signals_(signals),
      admission_(std::move(secrets), options.origins, options.session),
      client_(core_options(options, id), port),
      gateway_(options.limits, client_) {
  if (options.state.empty()) return;
  kept_.emplace(options.state);
  keep_ns_ = steady_ns() + following::KeptState::kFirstNs;
}

void Service::follow(const std::stop_token& stop, WebServer& server) {
  constexpr std::int64_t kLongestNs = 100 * kMillisecond;
  while (!stop.stop_requested()) {
    std::int64_t due_ns = 0;
    bool ready = false;
    {
      const std::lock_guard lock(mutex_);
      due_ns = client_.poll(gateway_, client::now());
      due_ns = std::min(due_ns, gateway_.poll(steady_ns()));
      if (const auto& session = gateway_.session(); session && session->epoch != epoch_) {
        epoch_ = session->epoch;
        logging::set_context(session->session, epoch_);
      }
      watch();
      ready = gateway_.any_ready(steady_ns());
    }
    if (ready) server.wake();
    keep_state();
    const std::int64_t wait_ns = std::min(kLongestNs, due_ns - steady_ns());
    if (wait_ns > 0) port_.wait(std::chrono::nanoseconds(wait_ns));
  }
}

// The file is written without the lock, so that no viewer waits for it.
void Service::keep_state() {
  const std::int64_t now_ns = steady_ns();
  if (!kept_ || now_ns < keep_ns_) return;
  following::KeptState::States states;
  {
    const std::lock_guard lock(mutex_);
    if (!gateway_.session()) return;
    if (auto cut = client_.cut())
      states.push_back(following::KeptState::state(std::move(*cut), gateway_.session()->epoch));
  }
  if (states.empty()) return;
  keep_ns_ = now_ns + following::KeptState::kIntervalNs;
  if (const auto written = kept_->write(states); !written) {
    spdlog::warn("{}: after a restart all viewers will join anew", written.error().message);
    kept_.reset();
  }
}

void Service::write_down(const GuestBook::Line& line) const {
  if (line) spdlog::info(*line);
}

Refusal Service::refuse(const Request& request, Refusal why) {
  ++gateway_.counts().of(why);
  write_down(guests_.refused(request.address, request.origin, closing(why).reason, steady_ns()));
  return why;
}

tl::expected<Pass, Refusal> Service::look_at(std::string_view token) const {
  return admission_.pass(token, wall_s()).map_error(refusal_of);
}

tl::expected<Pass, Refusal> Service::log_in(const Request& request) {
  auto pass = look_at(request.token);
  if (pass) return pass;
  const std::lock_guard lock(mutex_);
  return tl::unexpected(refuse(request, pass.error()));
}

std::variant<ViewerId, Refusal> Service::open(const Request& request) {
  auto pass = look_at(request.token);
  const std::lock_guard lock(mutex_);
  if (!admission_.origin_fits(request.origin, request.host)) return refuse(request, Refusal::kOrigin);
  if (!pass) return refuse(request, pass.error());
  const auto id = gateway_.admit(request.inputs, pass->may_act);
  if (!id) return refuse(request, Refusal::kFull);
  write_down(guests_.came(*id, {request.address, request.origin, std::move(*pass), 0}, steady_ns()));
  return *id;
}

std::optional<Refusal> Service::receive(ViewerId id, std::span<const std::byte> message) {
  const std::lock_guard lock(mutex_);
  return gateway_.receive(id, message, steady_ns());
}
Gateway::Next Service::next(ViewerId id) {
  const std::lock_guard lock(mutex_);
  return gateway_.next(id, steady_ns());
}
void Service::write_deeds(ViewerId id, std::int64_t now_ns) {
  const InputTally tally = gateway_.take_tally(id);
  std::string deeds;
  for (const auto& [kind, count] : tally) {
    if (!deeds.empty()) deeds += ' ';
    deeds += fmt::format("{}_acted={} {}_refused={}", kind, count.acted, kind, count.refused);
    if (count.refused > 0) deeds += fmt::format(" {}_reason={}", kind, metrics::reason_label(count.reason));
  }
  if (!deeds.empty()) write_down(guests_.did(id, deeds, now_ns));
}

void Service::closed(ViewerId id) {
  const std::lock_guard lock(mutex_);
  const std::int64_t now_ns = steady_ns();
  write_deeds(id, now_ns);
  gateway_.leave(id);
  write_down(guests_.left(id, now_ns));
}

void Service::list_ready(std::vector<ViewerId>& out) {
  const std::lock_guard lock(mutex_);
  gateway_.list_ready(steady_ns(), out);
}
void Service::list_not_reading(std::vector<ViewerId>& out) {
  const std::lock_guard lock(mutex_);
  gateway_.list_not_reading(steady_ns(), out);
  gateway_.counts().of(Refusal::kNotReading) += out.size();
}
void Service::list_silent(std::vector<ViewerId>& out) {
  const std::lock_guard lock(mutex_);
  gateway_.list_silent(steady_ns(), out);
}
void Service::list_over_cap(std::vector<std::pair<ViewerId, std::string>>& out) {
  const std::lock_guard lock(mutex_);
  gateway_.list_over_cap(steady_ns(), out);
}
void Service::refused(Refusal refusal) {
  const std::lock_guard lock(mutex_);
  ++gateway_.counts().of(refusal);
}
void Service::turned_away(TurnedAway why) {
  const std::lock_guard lock(mutex_);
  ++gateway_.counts().of(why);
  if (why != TurnedAway::kDescriptors) return;
  const std::int64_t now_ns = steady_ns();
  if (now_ns < quiet_until_ns_) return;
  quiet_until_ns_ = now_ns + CountLog::kPeriodNs;
  spdlog::warn(
      "out of file descriptors, so connections are closed: raise the limit (ulimit -n, LimitNOFILE=)");
}
void Service::list_over(std::vector<std::pair<ViewerId, Refusal>>& out) {
  out.clear();
  const std::int64_t now_s = wall_s();
  for (const auto& [id, guest] : guests_.guests()) {
    if (const auto why = admission_.over(guest.pass, now_s)) out.emplace_back(id, refusal_of(*why));
  }
}

void Service::reload() {
  notifier_.reloading(steady_ns());
  auto secrets = read_secrets(options_.token_file, options_.token_keys);
  if (!secrets) {
    spdlog::error("tokens stay as they were: {}", secrets.error().message);
    return;
  }
  for (const std::string& warning : secrets->warnings) spdlog::warn(warning);
  spdlog::info("tokens were read again: {} keys{}", secrets->keys.size(),
               secrets->token.empty() ? "" : " and a text");
  admission_.change(std::move(*secrets));
}

void Service::reloaded(const Result<std::string>& certificate) {
  if (!certificate) {
    spdlog::error("the certificate stays as it was: {}", certificate.error().message);
  } else if (!certificate->empty()) {
    spdlog::info("the certificate was read again; it ends on {}", *certificate);
  }
  const std::lock_guard lock(mutex_);
  notifier_.reloaded();
}

bool Service::tick() {
  const std::lock_guard lock(mutex_);
  const std::int64_t now_ns = steady_ns();
  if (const auto line = log_.line(gateway_.counts(), gateway_.viewers(), now_ns)) spdlog::info(*line);
  if (now_ns >= next_deeds_ns_) {
    next_deeds_ns_ = now_ns + kDeedsNs;
    for (const auto& [id, guest] : guests_.guests()) write_deeds(id, now_ns);
  }
  // With the lock, so that it is silent if either thread hangs.
  notifier_.alive(now_ns);
  if (notifier_.wants_status(now_ns))
    notifier_.tell(fmt::format("{}, frame {}, {} viewers", phase_name(client_.core().phase()),
                               gateway_.frame(), gateway_.viewers()));
  if (!signals_.take_reload()) return false;
  reload();
  return true;
}

Service::Health Service::health() {
  const std::lock_guard lock(mutex_);
  const Counts& counts = gateway_.counts();
  Json refused = Json::object();
  for (std::size_t i = 0; i < kClosings.size(); ++i) refused[kClosings[i].reason] = counts.refused[i];
  Json turned_away = Json::object();
  for (std::size_t i = 0; i < kTurnedAway.size(); ++i)
    turned_away[std::string(kTurnedAway[i])] = counts.turned_away[i];
  const metrics::Health::Answer alive = health_.alive();
  const Json health{{"alive", alive.good},
                    {"phase", phase_name(client_.core().phase())},
                    {"server_alive", gateway_.server_alive()},
                    {"epoch", gateway_.session() ? gateway_.session()->epoch : 0},
                    {"frame", gateway_.frame()},
                    {"viewers", gateway_.viewers()},
                    {"joined", counts.joined},
                    {"left", counts.left},
                    {"snapshots", counts.snapshots},
                    {"fell_behind", counts.skips},
                    {"resumed", counts.resumed},
                    {"messages", counts.messages},
                    {"bytes", counts.bytes},
                    {"inputs", counts.inputs},
                    {"inputs_sent", counts.inputs_sent},
                    {"inputs_refused", counts.inputs_refused},
                    {"stale", counts.stale},
                    {"refused", refused},
                    {"turned_away", turned_away}};
  return {health.dump() + '\n', alive.good};
}

Result<void> Service::serve_metrics(const metrics::Address& address, const std::string& session) {
  auto endpoint = metrics::Endpoint::create(
      address, health_, [this, session](metrics::Page& page) { describe(page, session, latest_.get()); });
  if (!endpoint) return tl::unexpected(endpoint.error());
  endpoint_ = std::move(*endpoint);
  spdlog::info(endpoint_->notice());
  return {};
}

// Hands over figures a few times a second, because a scrape must not wait for the lock, nor hold it.
void Service::watch() {
  const std::int64_t now_ns = steady_ns();
  if (now_ns >= next_figures_ns_) {
    next_figures_ns_ = now_ns + kSecond / 4;
    FiguresNow figures{.counts = gateway_.counts(), .viewers = gateway_.viewers(), .client = {}};
    figures.client = {.status = client_.core().status(),
                      .lag_s = client_.core().statistics().smoothed_latency_ns / 1e9};
    client_watch_.saw(figures.client.status, now_ns);
    health_.saw_frames(figures.client.status.frames_applied, client_.core().frames_are_due(now_ns), now_ns);
    latest_.offer(figures);
  }
  health_.beat(now_ns, client_watch_.obstacle());
}

}  // namespace tandem::gateway
