#pragma once
// Queues what clients are told of a frame.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/layout/layout.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/quiet_frames.hpp"
#include "services/host/outgoing/sent_frames.hpp"

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

/// Tells the clients of all streams the frames. Not thread-safe.
class Publication {
 public:
  /// When something is told: by the clock of the polls, and as clients are told.
  struct Stamp {
    std::int64_t now_ns = 0, wall_ns = 0;
  };

  Publication(Epoch epoch, std::size_t streams, std::uint32_t capacity);

  /// Queues the deltas of a frame, each cut into parts of kPartBytes; quiet frames wait. There must be room
  /// for a frame.
  void push(Outbox& outbox, const MadeFrame& frame, const Stamp& stamp);
  /// Queues what waits: nothing that has to be told follows soon. There must be room for a frame.
  void push_quiet(Outbox& outbox, const Stamp& stamp);
  /// The deltas that were queued, by stream.
  [[nodiscard]] std::span<const SentFrames> sent() const { return sent_; }

 private:
  void push_run(Outbox& outbox, std::uint32_t stream, bool all, const Stamp& stamp);
  void push_delta(Outbox& outbox, std::uint32_t stream, transport::DeltaMessage&& delta, const Stamp& stamp);

  Epoch epoch_;
  std::vector<QuietFrames> quiet_;  // by stream, as sent_
  std::vector<SentFrames> sent_;
};

}  // namespace tandem::host
