#include "services/host/outgoing/publication.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::host {

Publication::Publication(Epoch epoch, std::size_t streams, std::uint32_t capacity)
    : epoch_(epoch), quiet_(streams, QuietFrames(transport::max_quiet(capacity))), sent_(streams) {}

void Publication::push(Outbox& outbox, const MadeFrame& frame, const Stamp& stamp) {
  TANDEM_ASSERT(outbox.has_frame_room(1));  // the caller's thread is the only producer
  for (const MadeDelta& made : frame.deltas) {
    TANDEM_ASSERT(made.payload.size() <= transport::kMaxDeltaBytes && made.stream < sent_.size());
    const bool tells = quiet_[made.stream].take({.frame = frame.frame,
                                                 .hash = made.hash,
                                                 .last_input = frame.last_input,
                                                 .bytes = made.payload.size()});
    push_run(outbox, made.stream, tells, stamp);
    if (!tells) continue;
    const std::size_t parts = transport::part_count(made.payload.size(), transport::kPartBytes);
    for (std::size_t part = 0; part < parts; ++part) {
      const auto bytes = transport::part_of(made.payload, transport::kPartBytes, part);
      transport::DeltaMessage delta;
      delta.frame = frame.frame;
      delta.part = static_cast<std::uint32_t>(part);
      delta.parts = static_cast<std::uint32_t>(parts);
      delta.last_input = frame.last_input;
      delta.hash = made.hash;
      delta.payload.assign(bytes.begin(), bytes.end());
      push_delta(outbox, made.stream, std::move(delta), stamp);
    }
  }
  static_cast<void>(outbox.push(EndOfFrame{}));
}

void Publication::push_quiet(Outbox& outbox, const Stamp& stamp) {
  TANDEM_ASSERT(outbox.has_frame_room(1));
  for (std::uint32_t stream = 0; stream < sent_.size(); ++stream) push_run(outbox, stream, true, stamp);
  static_cast<void>(outbox.push(EndOfFrame{}));
}

void Publication::push_run(Outbox& outbox, std::uint32_t stream, bool all, const Stamp& stamp) {
  const auto run = quiet_[stream].release(all, stamp.now_ns);
  if (!run) return;
  transport::DeltaMessage delta;
  delta.frame = run->last;
  delta.quiet = run->before;
  delta.last_input = run->last_input;
  delta.hash = run->hash;
  push_delta(outbox, stream, std::move(delta), stamp);
}

void Publication::push_delta(Outbox& outbox, std::uint32_t stream, transport::DeltaMessage&& delta,
                             const Stamp& stamp) {
  delta.epoch = epoch_;
  delta.stream.id = stream;
  delta.server_time_ns = stamp.wall_ns;
  if (delta.part + 1 == delta.parts) {
    quiet_[stream].sent(stamp.now_ns);
    sent_[stream].add(delta.frame, stamp.now_ns);
  }
  static_cast<void>(outbox.push(std::move(delta)));
}

}  // namespace tandem::host
