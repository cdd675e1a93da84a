#include "services/host/host.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"
#include "services/host/clients/moment.hpp"
#include "services/host/frames/configuration_check.hpp"
#include "services/host/frames/live_source.hpp"
#include "services/host/impl.hpp"

namespace tandem::host {
namespace {

std::vector<std::string> names_of(const FrameSource& source) {
  std::vector<std::string> names;
  for (const transport::StreamMessage& offer : source.session().streams) {
    std::string name = source.name(offer.carries);
    if (name.empty()) name = std::to_string(offer.carries);
    if (offer.carries != offer.id.id) name += fmt::format(" (within {} ms)", offer.delay_ms);
    names.push_back(std::move(name));
  }
  return names;
}

Result<void> check_caps(const transport::SessionMessage& session, const transport::ServerPort& port) {
  for (const transport::StreamMessage& stream : session.streams) {
    if (!transport::is_cap(stream.cap_kbit_s)) continue;  // check_announcement() says what is wrong
    const std::uint32_t least = WireCap::least_kbit_s(capped(session, stream), port);
    if (stream.cap_kbit_s >= least) continue;
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("{}a cap of {} kbit/s has no room for headers, which need {} at {} frames a second "
                    "and a delay of {} ms; a longer delay needs less",
                    stream.name.empty() ? "" : "stream " + stream.name + ": ", stream.cap_kbit_s, least,
                    session.frame_rate_hz, stream.delay_ms));
  }
  return {};
}

std::vector<std::uint32_t> caps_of(const FrameSource& source) {
  std::vector<std::uint32_t> caps;
  for (const transport::StreamMessage& stream : source.session().streams) caps.push_back(stream.cap_kbit_s);
  return caps;
}

}  // namespace

Host::Impl::Impl(ServiceConfig configuration, std::unique_ptr<FrameSource> frames,
                 transport::ServerPort& endpoints)
    : config(std::move(configuration)),
      port(&endpoints),
      source(std::move(frames)),
      outbox(config.outbox),
      roster({.epoch = config.epoch,
              .streams = names_of(*source),
              .caps_kbit_s = caps_of(*source),
              .client_limit = config.client_limit,
              .participant_limit = config.participant_limit,
              .stall_timeout_ns = config.stall_timeout_ns,
              .fixed_window = config.window,
              .window_ceiling = config.window_ceiling}),
      succession(config.session, config.epoch, outbox),
      inputs(config.epoch, *source, outbox, succession.journal()),
      replies(config.epoch, outbox),
      claim(config.epoch, endpoints.self()),
      pacing(config.frame_rate_hz, config.free_rate),
      overrun(config.frame_rate_hz),
      publication(source->session(), endpoints) {
  if (config.takes_over_from) claim.takes_over(source->session().continues_epoch, *config.takes_over_from);
  claim.set_may_succeed(
      [this](const transport::ParticipantId& id) { return succession.standbys().may_succeed(id); });
  const auto streams = static_cast<std::uint32_t>(source->session().streams.size());
  for (std::uint32_t id = 0; id < streams; ++id) {
    lanes.emplace_back(id, config, outbox, *port);
    const transport::StreamMessage& offer = source->session().streams[id];
    lanes.back().totals.name = source->name(id);
    lanes.back().totals.delay_ms = offer.delay_ms;
    lanes.back().totals.encodes = offer.carries == id;
  }
  report.frame = source->frame();
  report.deltas.reserve(streams);
}

Result<std::unique_ptr<Host>> Host::create(HostConfig config, engine::Simulation& simulation,
                                           transport::ServerPort& port) {
  const auto before = std::exchange(config.goes_on_from, nullptr);
  if (before) {
    if (before->epoch >= config.epoch)
      return fail(ErrorCode::kInvalidArgument, "the epoch must be above the one that it continues");
    if (before->capacity() != simulation.capacity())
      return fail(ErrorCode::kInvalidArgument, "the checkpoint has another capacity");
    config.start_frame = config.continues_frame = before->frame;
    config.continues_epoch = before->epoch;
    config.wait_for = 0;
    config.goes_on_from = before;
  }
  if (auto good = check(config, simulation); !good) return tl::unexpected(good.error());
  auto source = LiveSource::create(config, simulation);
  if (!source) return tl::unexpected(source.error());
  if (auto good = check_caps((*source)->session(), port); !good) return tl::unexpected(good.error());
  auto host = Impl::create(std::move(config), std::move(*source), port);
  if (host && before) (*host)->impl_->roster.remember(before->clients);
  return host;
}

Result<std::unique_ptr<Host>> Host::create(ServiceConfig config, std::unique_ptr<FrameSource> source,
                                           transport::ServerPort& port) {
  return Impl::create(std::move(config), std::move(source), port);
}

Result<std::unique_ptr<Host>> Host::Impl::create(ServiceConfig config, std::unique_ptr<FrameSource> source,
                                                 transport::ServerPort& port) {
  if (auto good = check(config); !good) return tl::unexpected(good.error());
  if (auto good = transport::check_announcement(source->session()); !good)
    return tl::unexpected(good.error());
  const auto streams = static_cast<std::uint32_t>(source->session().streams.size());
  if (auto opened = port.open_streams(streams); !opened) return tl::unexpected(opened.error());
  return std::unique_ptr<Host>(new Host(std::make_unique<Impl>(std::move(config), std::move(source), port)));
}

Host::Host(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Host::~Host() = default;

bool Host::poll(std::int64_t now_ns, std::int64_t wall_ns) {
  TANDEM_ASSERT(!impl_->first_poll_ns || now_ns >= impl_->last_poll_ns);
  impl_->now_ns = now_ns;
  impl_->wall_ns = wall_ns;
  if (!impl_->wall_ahead_ns) impl_->wall_ahead_ns = wall_ns - now_ns;
  return impl_->poll();
}

std::int64_t Host::next_wake_ns() const { return impl_->wake_ns; }
bool Host::frame_under_way() const { return impl_->source->stepping(); }
void Host::rest_after_frame() { impl_->source->rest_after_frame(); }
void Host::tell_collected_frames() { impl_->tell_collected_frames(true); }
int Host::descriptor() const { return frame_under_way() ? impl_->source->next_descriptor() : -1; }
Host::State Host::state() const { return impl_->state; }
const std::optional<Error>& Host::error() const { return impl_->error; }
const FrameReport& Host::report() const { return impl_->report; }
Outbox& Host::outbox() { return impl_->outbox; }
Result<Frame> Host::inject(const engine::Input& input) {
  if (impl_->succession.stopped()) return fail(ErrorCode::kCapacity, "the session is being handed over");
  return impl_->inputs.inject(input, impl_->source->frame() + 1, impl_->now_ns);
}
Result<void> Host::set_parameters(const StreamParameters& parameters, std::uint32_t stream) {
  return impl_->source->set_parameters(stream, parameters);
}
const StreamParameters& Host::parameters(std::uint32_t stream) const {
  return impl_->source->parameters(stream);
}
NewsDesk* Host::news() { return impl_->source->news(); }
void Host::capture(checkpoint::Checkpoint& out) const {
  TANDEM_ASSERT(!frame_under_way());
  out.wall_ms = impl_->wall_ns / kMillisecond;
  impl_->source->capture(out);
  impl_->roster.capture(out.clients);
  out.journal = impl_->succession.journal().number();
}
bool Host::wants_checkpoints() const { return impl_->succession.standbys().any(); }
bool Host::wants_checkpoint_now() const { return impl_->succession.wants_checkpoint_now(); }
void Host::offer_checkpoint(const std::shared_ptr<const checkpoint::Encoded>& checkpoint) {
  impl_->succession.standbys().offer(checkpoint, impl_->now_ns);
}
const Standbys& Host::standbys() const { return impl_->succession.standbys(); }
double Host::threshold_m(std::uint32_t stream) const { return impl_->threshold_m(stream); }
std::uint32_t Host::first_made() const { return impl_->first_made(); }
const transport::SessionMessage& Host::session() const { return impl_->source->session(); }
Frame Host::frame() const { return impl_->source->frame(); }
const tandem::State& Host::agreed() const { return impl_->source->agreed(impl_->first_made()); }
std::uint64_t Host::hash() const { return impl_->source->hash(impl_->first_made()); }
Result<void> Host::set_limits(std::uint32_t client_limit, std::optional<std::int64_t> stall_timeout_ns) {
  if (client_limit == 0) return fail(ErrorCode::kInvalidArgument, "a limit of clients is at least 1");
  impl_->roster.set_limits(client_limit, stall_timeout_ns);
  return {};
}

std::uint32_t Host::window() const { return impl_->roster.window(); }
std::uint32_t Host::participants() const { return impl_->roster.counted(); }
std::uint32_t Host::observers() const { return impl_->roster.watching(); }

HostTotals Host::totals() const { return impl_->totals_now(); }
HostMoment Host::present() const {
  return host_moment(impl_->roster, *impl_->source, impl_->publication.sent(), impl_->outbox);
}

std::vector<std::string> Host::take_notices() { return impl_->roster.notices().take(); }
std::vector<std::string> Host::take_warnings() { return impl_->roster.notices().take_warnings(); }

}  // namespace tandem::host
