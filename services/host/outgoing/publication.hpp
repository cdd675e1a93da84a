#pragma once
// Cuts the deltas of a frame into parts.

#include <cstddef>
#include <cstdint>
#include <span>

#include "sdk/core/layout/layout.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// One stream's part of a frame that was made.
struct MadeDelta {
  std::uint32_t stream = 0;
  std::uint64_t hash = 0;
  std::span<const std::byte> payload = {};
  std::uint32_t corrected = 0;
  std::int64_t predict_ns = 0, encode_ns = 0, apply_ns = 0;  ///< durations; 0 without a clock
};

struct MadeFrame {
  Frame frame = 0;
  std::uint64_t last_input = 0;
  std::span<const MadeDelta> deltas;  ///< one for each active stream, ascending; valid until the next frame
                                      ///< is made
  std::int64_t step_ns = 0;           ///< duration of the engine's step; 0 without a clock
};

/// Queues the deltas of a frame, each cut into parts of kPartBytes. There must be room for a frame.
void push_frame(Outbox& outbox, Epoch epoch, const MadeFrame& frame, std::int64_t wall_ns);

}  // namespace tandem::host
