#include "services/host/live_source.hpp"

#include <algorithm>
#include <utility>

#include "services/host/publication.hpp"

namespace tandem::host {

using transport::Reason;

LiveSource::LiveSource(const HostConfig& config, engine::Simulation& simulation, Stream stream)
    : simulation_(&simulation), stream_(std::move(stream)), clock_ns_(config.clock_ns) {
  stream_.set_clock(clock_ns_);
  session_ = session_message(config, stream_);
}

std::optional<FrameSource::Made> LiveSource::next(bool snapshot_follows, Outbox& /*outbox*/) {
  const std::int64_t start_ns = clock();
  apply(next_frame());
  simulation_->step();
  const std::int64_t stepped_ns = clock();
  const engine::Bodies bodies = simulation_->bodies();
  if (auto good = stream_.check(bodies); !good) {
    error_ = good.error();
    return std::nullopt;
  }
  if (snapshot_follows) stream_.round_next();
  const Stream::FrameResult frame = stream_.produce(bodies, simulation_->events());
  return Made{.frame = frame.frame,
              .last_input = frame.last_input,
              .hash = frame.hash,
              .payload = frame.payload,
              .corrected = frame.corrected,
              .step_ns = stepped_ns - start_ns};
}

Reason LiveSource::accept(const engine::Input& input, const InputOrigin& origin, Outbox& outbox,
                          Frame& acts_on) {
  const engine::Classification effect = simulation_->classify(input);
  switch (effect.effect) {
    case engine::Classification::Effect::kScheduled:
      return schedule(input, effect, origin, outbox, acts_on);
    case engine::Classification::Effect::kImmediate:
      if (immediate_.size() >= kMostImmediate) return Reason::kRateLimited;
      immediate_.push_back(input);
      acts_on = next_frame();
      return Reason::kNone;
    case engine::Classification::Effect::kRefused:
      break;
  }
  return Reason::kInvalid;
}

Reason LiveSource::schedule(const engine::Input& input, const engine::Classification& effect,
                            const InputOrigin& origin, Outbox& outbox, Frame& acts_on) {
  const auto drive = to_drive(stream_.config().lattice, effect.gravity, effect.damping_per_s);
  if (!drive) return Reason::kInvalid;
  // s + A: no client can have simulated it, as none is further than A beyond delta s - 1.
  const Frame frame = next_frame() + stream_.config().layout.lead;
  if (scheduling_frame_ != frame) scheduled_now_ = 0;
  if (scheduled_now_ >= kMostScheduledPerFrame || !outbox.has_control_room()) return Reason::kRateLimited;
  const std::uint64_t number = stream_.last_input() + 1;
  if (!stream_.schedule({.number = number, .frame = frame, .drive = *drive})) return Reason::kRateLimited;
  scheduling_frame_ = frame;
  ++scheduled_now_;
  scheduled_.push_back({frame, input});
  acts_on = frame;
  const bool queued = outbox.push(transport::ScheduledInputMessage{
      .epoch = session_.epoch,
      .number = number,
      .frame = frame,
      .source_client = origin.client,
      .source_number = origin.number,
      .kind = static_cast<std::uint32_t>(transport::ScheduledKind::kDrive),
      .values = {drive->gravity[0], drive->gravity[1], drive->gravity[2], drive->damping}});
  return queued ? Reason::kNone : Reason::kRateLimited;
}

Result<Frame> LiveSource::inject(const engine::Input& input, Outbox& outbox) {
  Frame acts_on = 0;
  switch (accept(input, {}, outbox, acts_on)) {
    case Reason::kNone:
      return acts_on;
    case Reason::kInvalid:
      return fail(ErrorCode::kInvalidArgument, "the simulation refuses this input");
    default:
      return fail(ErrorCode::kCapacity, "too many inputs at once");
  }
}

void LiveSource::apply(Frame s) {
  const auto later = std::ranges::find_if(scheduled_, [s](const Waiting& w) { return w.frame > s; });
  for (auto it = scheduled_.begin(); it != later; ++it) simulation_->apply(it->input);
  scheduled_.erase(scheduled_.begin(), later);
  for (const engine::Input& input : immediate_) simulation_->apply(input);
  immediate_.clear();
}

}  // namespace tandem::host
