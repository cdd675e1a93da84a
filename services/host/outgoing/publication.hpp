#pragma once
// Queues what clients are told of a frame.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/core/layout/layout.hpp"
#include "services/host/outgoing/delta_collector.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/sent_frames.hpp"
#include "services/host/outgoing/wire_cap.hpp"

namespace tandem::host {

/// One stream's part of a frame that was made.
struct MadeDelta {
  std::uint32_t stream = 0;
  std::uint64_t hash = 0;
  std::span<const std::byte> payload = {};
  std::uint32_t corrected = 0;
  bool at_once = false;  ///< its delta waits for no further frame
  /// Durations; 0 without a clock, and where it is the delta of an offer before.
  std::int64_t predict_ns = 0, encode_ns = 0, apply_ns = 0;
};

struct MadeFrame {
  Frame frame = 0;
  std::uint64_t last_input = 0;
  std::span<const MadeDelta> deltas;  ///< one for each active stream, ascending; valid until the next frame
                                      ///< is made
  std::int64_t step_ns = 0;           ///< duration of the engine's step; 0 without a clock
  bool hurries = false;               ///< a client's input acted on it, or it tells an event
};

/// Tells the clients of all streams the frames. Not thread-safe.
class Publication {
 public:
  /// When something is told: by the clock of the polls, and as clients are told.
  struct Stamp {
    std::int64_t now_ns = 0, wall_ns = 0;
  };

  /// The port must outlive it.
  Publication(const transport::SessionMessage& session, const transport::ServerPort& port);

  /// What the next frame of each stream may take, by stream; valid until the next call.
  [[nodiscard]] std::span<const FrameBudget> budgets(std::int64_t now_ns);

  /// Queues the deltas of a frame, or collects it. There must be room for a frame.
  void push(Outbox& outbox, const MadeFrame& frame, const Stamp& stamp);
  /// Queues frames that have waited for long enough; `all`: whatever is collected, because no frame follows
  /// soon. There must be room for a frame.
  void push_collected(Outbox& outbox, bool all, std::int64_t now_ns);
  /// The deltas that were queued, by stream.
  [[nodiscard]] std::span<const SentFrames> sent() const { return sent_; }
  /// Messages with deltas that were queued, and their bytes, by stream.
  struct Told {
    std::uint64_t messages = 0, bytes = 0;
  };
  [[nodiscard]] std::span<const Told> told() const { return told_; }

 private:
  void push_leaving(Outbox& outbox, std::uint32_t stream, std::int64_t now_ns);

  /// Frames on which an input acted, or which tell an event, are told at once, but only one in this time:
  /// otherwise a client that pushes on and on, or a simulation full of events, would undo the collecting for
  /// all.
  static constexpr std::int64_t kHurryNs = 100 * kMillisecond;

  Epoch epoch_;
  std::int64_t hurried_ns_ = INT64_MIN / 2;
  std::vector<DeltaCollector> collectors_;  // by stream, as sent_
  std::vector<std::optional<WireCap>> caps_;
  std::vector<FrameBudget> budgets_;
  std::vector<SentFrames> sent_;
  std::vector<Told> told_;
  std::vector<transport::DeltaMessage> leaving_;  // kept to reuse its memory
};

}  // namespace tandem::host
