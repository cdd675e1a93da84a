#include "services/host/outgoing/publication.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::host {

void push_frame(Outbox& outbox, Epoch epoch, const MadeFrame& frame, std::int64_t wall_ns) {
  TANDEM_ASSERT(outbox.has_frame_room(1));  // the caller's thread is the only producer
  for (const MadeDelta& made : frame.deltas) {
    TANDEM_ASSERT(made.payload.size() <= transport::kMaxDeltaBytes);
    const std::size_t parts = transport::part_count(made.payload.size(), transport::kPartBytes);
    for (std::size_t part = 0; part < parts; ++part) {
      const auto bytes = transport::part_of(made.payload, transport::kPartBytes, part);
      transport::DeltaMessage delta;
      delta.epoch = epoch;
      delta.stream.id = made.stream;
      delta.frame = frame.frame;
      delta.part = static_cast<std::uint32_t>(part);
      delta.parts = static_cast<std::uint32_t>(parts);
      delta.last_input = frame.last_input;
      delta.server_time_ns = wall_ns;
      delta.hash = made.hash;
      delta.payload.assign(bytes.begin(), bytes.end());
      static_cast<void>(outbox.push(std::move(delta)));
    }
  }
  static_cast<void>(outbox.push(EndOfFrame{}));
}

}  // namespace tandem::host
