#pragma once
// The figures of one client.

#include <array>
#include <cstdint>

#include "sdk/client/session/resync_reason.hpp"
#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/wire/units.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// Time that playing took since the first applied frame, by kind. Zero without CoreOptions::measure_ns.
struct CostTotals {
  std::int64_t receive_ns = 0;      ///< taking messages from the port
  std::int64_t predict_ns = 0;      ///< predicted steps
  std::int64_t decode_ns = 0;       ///< decoding deltas and applying corrections
  std::int64_t hash_ns = 0;         ///< checking the agreed states
  std::int64_t acknowledge_ns = 0;  ///< writing acknowledgements
};

/// Counts since the client was made; they survive rejoins and epochs. The counts of ClientFigures are updated
/// in place; its durations and rates are filled in by figures().
struct Statistics : ClientFigures {
  std::array<std::uint64_t, kResyncReasons> resyncs_by_reason{};
  std::uint64_t epochs = 0;
  std::uint64_t stale_messages = 0;    ///< of another epoch
  std::uint64_t foreign_messages = 0;  ///< not from the participant that announced the session
  std::int64_t first_applied_ns = 0, last_applied_ns = 0;  ///< steady clock
  std::uint64_t wire_bytes = 0, wire_bytes_before = 0;     ///< of the port, now and before the first frame
  std::int64_t wire_ns = 0;                                ///< steady clock of wire_bytes
  std::int64_t join_ns = 0;                                ///< duration of the last join
  double smoothed_latency_ns = 0;   ///< from publishing to applying, over about the last half second; the
                                    ///< stream's delay does not count
  DurationHistogram latency;        ///< from publishing to applying
  DurationHistogram input_latency;  ///< from sending to applying the frame that the input acted on
  DurationHistogram frame_cost;     ///< decode, apply and simulate, per applied frame
  DurationHistogram recent_cost;    ///< the same since the last status report
  CostTotals costs;

  void add_latency(std::int64_t latency_ns) {
    latency.add(latency_ns);
    const double gain = latency.count() == 1 ? 1 : 1.0 / 16;
    smoothed_latency_ns += (static_cast<double>(latency_ns) - smoothed_latency_ns) * gain;
  }
  /// Payload rate since the first applied frame; 1 Mbit = 2^20 bits.
  [[nodiscard]] double mean_mbit_per_s() const {
    const auto span_ns = static_cast<double>(last_applied_ns - first_applied_ns);
    return span_ns > 0 ? static_cast<double>(payload_bytes) * 8 / kBitsPerMbit / (span_ns / 1e9) : 0;
  }
  /// The same of packets with all headers.
  [[nodiscard]] double mean_wire_mbit_per_s() const {
    const auto span_ns = static_cast<double>(wire_ns - first_applied_ns);
    if (first_applied_ns == 0 || span_ns <= 0) return 0;
    return static_cast<double>(wire_bytes - wire_bytes_before) * 8 / kBitsPerMbit / (span_ns / 1e9);
  }
};

/// The figures of a client's status; the other fields have their defaults.
[[nodiscard]] ClientStatus figures(const Statistics& statistics);

}  // namespace tandem::client
