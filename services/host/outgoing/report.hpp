#pragma once
// The figures of a host for its operator.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/layout/layout.hpp"
#include "tandem/server_figures.hpp"

namespace tandem::host {

/// One stream's part of a frame.
struct DeltaReport {
  std::uint32_t stream = 0;
  std::uint64_t hash = 0;
  std::size_t payload_bytes = 0;
  std::uint32_t corrected = 0;
};

/// The frame that was produced last.
struct FrameReport {
  Frame frame = 0;
  std::vector<DeltaReport> deltas;   ///< one for each stream that was made, ascending
  double frame_ms = 0, step_ms = 0;  ///< the whole frame (step, quantise, predict, encode, apply); the
                                     ///< engine's step alone
};

/// Counts of one stream since the start.
struct StreamTotals {
  std::string name;
  bool made = false;  ///< the stream is made now
  std::uint64_t frames = 0, corrected = 0, payload_bytes = 0;
  std::uint64_t snapshots = 0, snapshot_bytes = 0;
  std::uint32_t participants = 0, observers = 0;  ///< now, of the stream
};

/// Counts since the start. They are sums over all streams where streams differ.
struct HostTotals : ServerCounts {
  std::uint64_t frames = 0, corrected = 0;
  std::uint64_t payload_bytes = 0;  ///< of the deltas themselves
  std::uint64_t demotions = 0, clients_seen = 0;
  double frame_ms_p50 = 0, frame_ms_p99 = 0;
  std::vector<StreamTotals> streams;  ///< in the order of their ids
};

}  // namespace tandem::host
