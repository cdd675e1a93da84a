#pragma once
// The figures of a host for its operator.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/layout/layout.hpp"
#include "sdk/wire/messages.hpp"
#include "tandem/server_figures.hpp"

namespace tandem::host {

/// One stream's part of a frame.
struct DeltaReport {
  std::uint32_t stream = 0;
  std::uint64_t hash = 0;
  std::size_t payload_bytes = 0;
  std::uint32_t corrected = 0;
  /// Durations; 0 without a clock, and where it is the delta of an offer before. Encoding includes correcting
  /// the agreed state; applying is its hash.
  std::int64_t predict_ns = 0, encode_ns = 0, apply_ns = 0;
};

/// The frame that was produced last.
struct FrameReport {
  Frame frame = 0;
  std::vector<DeltaReport> deltas;   ///< one for each stream that was made, ascending
  double frame_ms = 0, step_ms = 0;  ///< the whole frame (step, quantise, predict, encode, apply); the
                                     ///< engine's step alone
};

/// Counts of what was refused, by reason.
struct Refusals {
  std::array<std::uint64_t, transport::kReasons> by_reason{};

  void add(transport::Reason reason) {
    const auto index = static_cast<std::size_t>(reason);
    TANDEM_ASSERT(index < by_reason.size());
    ++by_reason[index];
  }
  [[nodiscard]] std::uint64_t total() const {
    std::uint64_t total = 0;
    for (const std::uint64_t count : by_reason) total += count;
    return total;
  }
};

/// Counts of one stream since the start.
struct StreamTotals {
  std::string name;
  std::uint32_t delay_ms = 0;
  bool encodes = true;  ///< false: it is another offer of the stream of this name
  bool made = false;    ///< the stream is made now
  std::uint64_t frames = 0, corrected = 0, payload_bytes = 0;
  std::uint64_t messages = 0, message_bytes = 0;  ///< with deltas, as they are handed to the writer
  std::uint64_t snapshots = 0, snapshot_bytes = 0;
  std::uint32_t participants = 0, observers = 0;  ///< now, of the stream
};

/// Counts since the start. They are sums over all streams where streams differ.
struct HostTotals : ServerCounts {
  std::uint64_t frames = 0, corrected = 0;
  std::uint64_t payload_bytes = 0;  ///< of the deltas themselves
  std::uint64_t demotions = 0, clients_seen = 0;
  std::uint32_t hidden = 0;                   ///< bodies of the simulation that clients do not see, now
  std::uint64_t repeated_demotions = 0;       ///< of clients that had been demoted in the five minutes before
  std::uint64_t rejoins = 0;                  ///< snapshots for clients that had played or joined before
  Refusals inputs_refused, messages_refused;  ///< of refused_inputs and refused_messages, what has a reason
  double frame_ms_p50 = 0, frame_ms_p99 = 0;
  std::vector<StreamTotals> streams;  ///< in the order of their ids
};

/// The state of one stream at a moment.
struct StreamMoment {
  std::uint32_t at_rest = 0;                    ///< bodies; 0 while the stream is not made
  std::uint32_t crowded = 0;                    ///< bodies that the predicted step lets through others
  std::uint32_t joining = 0;                    ///< clients that wait for a snapshot, or receive it
  std::uint32_t longest_lag = 0;                ///< frames that the slowest client that plays is behind
  double threshold_m = 0;                       ///< in force
  double error_rms_m = 0, error_largest_m = 0;  ///< distance of agreed from real positions, over a part of
                                                ///< the bodies; 0 while the stream is not made
};

/// The state of a host at a moment, besides its counts.
struct HostMoment {
  std::uint32_t bodies = 0, window = 0;
  std::uint32_t dds_participants = 0;       ///< that have clients here
  std::int64_t longest_round_trip_ns = 0;   ///< from a frame to its acknowledgement, of a participant
  std::size_t queued = 0, queued_most = 0;  ///< messages that wait to be sent; the most there were
  std::uint32_t queued_frames = 0;          ///< frames that wait to be sent
  std::vector<StreamMoment> streams;        ///< in the order of their ids
};

}  // namespace tandem::host
