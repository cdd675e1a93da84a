#include "services/tool/recorded_source.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/units.hpp"
#include "services/engines/scenes/replayed.hpp"

namespace tandem::tool {

using recording::Playback;

namespace {

// The drive tells it but for rounding. Where the two agree, the session's own number is the exact one.
std::array<double, 3> gravity_now(const transport::SessionMessage& session, const Drive& drive) {
  const double quantum = session.lattice_unit / 64 / (session.dt_s * session.dt_s);
  std::array<double, 3> gravity = session.gravity;
  for (std::size_t axis = 0; axis < gravity.size(); ++axis) {
    const double now = drive.gravity[axis] * quantum;
    if (!(std::abs(now - gravity[axis]) <= quantum)) gravity[axis] = now;
  }
  return gravity;
}

}  // namespace

RecordedSource::RecordedSource(Playback& playback, const host::ServiceConfig& config,
                               accounts::TokenBucket& seeks)
    : playback_(&playback), seeks_(&seeks), clock_ns_(config.clock_ns), session_(playback.session()) {
  TANDEM_ASSERT(playback.has_run());
  transport::StreamMessage stream = playback.stream();
  stream.id = {};
  stream.carries = 0;
  session_.streams.clear();
  session_.streams.push_back(std::move(stream));
  session_.session = config.session;
  session_.epoch = config.epoch;
  session_.frame_rate_hz = config.frame_rate_hz;
  scenes::Recording recording{.started_unix_ms = playback.first_ns() / kMillisecond,
                              .length_s = playback.length_s(),
                              .from_s = playback.time_s(),
                              .from_frame = frame(),
                              .frame_rate_hz = playback.session().frame_rate_hz};
  for (const recording::RecordedEvent& event : playback.events())
    recording.events.push_back({.at_s = playback.time_s(event), .text = event.text});
  session_.scene_json = scenes::replayed(session_.scene_json, recording);
  session_.window_ceiling = config.window_ceiling;
  session_.gravity = gravity_now(session_, timeline().drive());
  session_.continues_epoch = session_.continues_frame = 0;
  playback.timeline().rename(config.epoch, {});
}

std::optional<host::MadeFrame> RecordedSource::next(host::StreamSet /*snapshots_follow*/,
                                                    host::Outbox& outbox) {
  if (sought_s_ || !ending_ || *ending_ != Playback::Step::kFrame) return std::nullopt;
  ending_ = playback_->next();
  if (!ending_ || *ending_ != Playback::Step::kFrame) return std::nullopt;
  for (transport::ScheduledInputMessage input : playback_->inputs()) {
    input.epoch = session_.epoch;
    if (!outbox.push(std::move(input))) {
      ending_ = fail(ErrorCode::kCapacity, "more scheduled inputs in a frame than can be queued");
      return std::nullopt;
    }
  }
  const client::CompleteDelta& delta = playback_->delta();
  delta_ = {.hash = delta.hash,
            .payload = delta.payload,
            .corrected = static_cast<std::uint32_t>(timeline().touched().size())};
  return host::MadeFrame{.frame = delta.frame, .last_input = delta.last_input, .deltas = {&delta_, 1}};
}

bool RecordedSource::refresh_names() {
  if (session_.names == playback_->session().names) return false;
  session_.names = playback_->session().names;
  return true;
}

host::InputVerdict RecordedSource::accept(const transport::InputMessage& input,
                                          const host::InputTerms& /*terms*/, host::Outbox& /*outbox*/) {
  using transport::Reason;
  if (input.kind != static_cast<std::uint32_t>(transport::InputKind::kSeek)) return {Reason::kRecording};
  if (input.values.size() != 1 || !input.bytes.empty()) return {Reason::kInvalid};
  if (!(input.values[0] >= 0 && input.values[0] <= playback_->length_s())) {
    return {Reason::kInvalid, 0, fmt::format("the recording is {:.1f} s long", playback_->length_s())};
  }
  if (sought_s_ || !seeks_->take(clock_ns_())) return {Reason::kRateLimited};
  sought_s_ = input.values[0];
  return {Reason::kNone, frame()};
}

}  // namespace tandem::tool
