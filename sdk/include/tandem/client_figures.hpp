#pragma once
// The figures of a client. Each figure is written here once: as a line in a struct and as a line in the list
// below the struct. The C interface, the status message, C++, Python, the browser, `tandem join` and `tandem
// top` use the lists. In Tandem's sources, CONTRIBUTING.md says under "Where a new thing goes" where
// else a new figure has to be named and what checks it.

#include <cstdint>

namespace tandem {

// sdk/package/figures.py reads the structs: each figure is one line, followed by its text.

/// Figures that a client also publishes once a second for monitors of its session: TandemClientStatus.
struct ReportedFigures {
  double client_ms_p50 = 0;           ///< decode, apply and simulate one frame
  double mbit_per_s = 0;              ///< payload rate since the first frame; 1 Mbit = 2^20 bits
  double wire_mbit_per_s = 0;         ///< the same of packets with all headers, in both directions, computed
  std::uint64_t frames_applied = 0;   ///< deltas that were applied
  std::uint64_t resyncs = 0;          ///< rejoins: joins after the first one of an epoch
  std::uint64_t hash_mismatches = 0;  ///< frames whose state differed from the server's
  std::uint64_t inputs_sent = 0;      ///< whatever their outcome
  std::uint64_t inputs_refused = 0;   ///< refused by the server
  bool operator==(const ReportedFigures&) const = default;
};

/// All figures of a client since connect(). Times are in milliseconds. Percentiles are over all frames.
struct ClientFigures : ReportedFigures {
  std::uint64_t refused_messages = 0;  ///< bytes that broke a rule of the protocol
  std::uint64_t payload_bytes = 0;     ///< of deltas
  double latency_ms_p50 = 0;           ///< from publishing to applying; to half a round trip if clocks differ
  double latency_ms_p99 = 0;           ///< as latency_ms_p50
  double input_latency_ms_p50 = 0;     ///< from sending to applying the frame that the input acted on
  double input_latency_ms_p99 = 0;     ///< as input_latency_ms_p50
  double client_ms_p99 = 0;            ///< as client_ms_p50
  double join_ms = 0;                  ///< last join: from finding the session, or from losing it, to playing
  double round_trip_ms = 0;            ///< to the server and back
  double jitter_ms = 0;                ///< mean deviation of the times at which deltas are published
  std::uint64_t stream_changes = 0;    ///< changes from one stream of a session to another
  std::uint64_t inputs_acted = 0;      ///< acted on a frame that was applied
  std::uint64_t inputs_unknown = 0;    ///< the input or its answer was lost
  std::uint32_t queue_high_water = 0;  ///< maximum number of deltas that waited at once
  bool operator==(const ClientFigures&) const = default;
};

/// Calls visit("name", that figure of each of `of`) for one figure after the other, in the order of
/// idl/tandem.idl. The structs in `of` may be of any type with these members: of C, of the IDL, or several to
/// copy from one to the other.
template <class Visit, class... Of>
constexpr void each_reported_figure(const Visit& visit, Of&... of) {
  visit("client_ms_p50", of.client_ms_p50...);
  visit("mbit_per_s", of.mbit_per_s...);
  visit("wire_mbit_per_s", of.wire_mbit_per_s...);
  visit("frames_applied", of.frames_applied...);
  visit("resyncs", of.resyncs...);
  visit("hash_mismatches", of.hash_mismatches...);
  visit("inputs_sent", of.inputs_sent...);
  visit("inputs_refused", of.inputs_refused...);
}

/// Does the same for all figures.
template <class Visit, class... Of>
constexpr void each_client_figure(const Visit& visit, Of&... of) {
  each_reported_figure(visit, of...);
  visit("refused_messages", of.refused_messages...);
  visit("payload_bytes", of.payload_bytes...);
  visit("latency_ms_p50", of.latency_ms_p50...);
  visit("latency_ms_p99", of.latency_ms_p99...);
  visit("input_latency_ms_p50", of.input_latency_ms_p50...);
  visit("input_latency_ms_p99", of.input_latency_ms_p99...);
  visit("client_ms_p99", of.client_ms_p99...);
  visit("join_ms", of.join_ms...);
  visit("round_trip_ms", of.round_trip_ms...);
  visit("jitter_ms", of.jitter_ms...);
  visit("stream_changes", of.stream_changes...);
  visit("inputs_acted", of.inputs_acted...);
  visit("inputs_unknown", of.inputs_unknown...);
  visit("queue_high_water", of.queue_high_water...);
}

}  // namespace tandem
