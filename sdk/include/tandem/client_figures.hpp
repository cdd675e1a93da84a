#pragma once
// The figures of a client. Each is written once, here: a line in a struct and a line in the list behind it.
// The C interface, the status message, C++, Python, the browser, `tandem join` and `tandem top` go through
// the lists. Where else a new one has to be named, and what then checks it: CONTRIBUTING.md, "Where a new
// thing goes".

#include <cstdint>

namespace tandem {

// sdk/package/figures.py reads the structs: a figure a line, with its text behind it.

/// Those that a client also sends, once a second, to whoever watches its session: TandemClientStatus.
struct ReportedFigures {
  double client_ms_p50 = 0;           ///< decode, apply and simulate, a frame
  double mbit_per_s = 0;              ///< of payload since the first frame; 2^20 bits to the Mbit
  std::uint64_t frames_applied = 0;   ///< deltas
  std::uint64_t resyncs = 0;          ///< joins after the first one of an epoch
  std::uint64_t hash_mismatches = 0;  ///< frames whose state was not the server's
  std::uint64_t inputs_sent = 0;      ///< whatever became of them
  std::uint64_t inputs_refused = 0;   ///< by the server
  bool operator==(const ReportedFigures&) const = default;
};

/// All, since connect(). Times in milliseconds, percentiles over all frames.
struct ClientFigures : ReportedFigures {
  std::uint64_t refused_messages = 0;  ///< bytes that broke a rule of the protocol
  std::uint64_t payload_bytes = 0;     ///< of deltas
  double latency_ms_p50 = 0;           ///< publish to applied; needs one clock for both hosts
  double latency_ms_p99 = 0;           ///< as latency_ms_p50
  double input_latency_ms_p50 = 0;     ///< sent until the frame it acted on was applied
  double input_latency_ms_p99 = 0;     ///< as input_latency_ms_p50
  double client_ms_p99 = 0;            ///< as client_ms_p50
  double join_ms = 0;                  ///< last join: from knowing the session, or the loss, to playing
  double round_trip_ms = 0;            ///< to the server and back
  double jitter_ms = 0;                ///< by which deltas come late
  std::uint64_t stream_changes = 0;    ///< from one stream of a session to another
  std::uint64_t inputs_acted = 0;      ///< on a frame that was applied
  std::uint64_t inputs_unknown = 0;    ///< lost on the way, or their answer was
  std::uint32_t queue_high_water = 0;  ///< deltas that waited at once, at most
  bool operator==(const ClientFigures&) const = default;
};

/// Calls visit("name", that figure of each of `of`) one by one, in the order of idl/tandem.idl. What is in
/// `of` may be any struct with these members: of C, of the IDL, several to copy from one to the other.
template <class Visit, class... Of>
constexpr void each_reported_figure(const Visit& visit, Of&... of) {
  visit("client_ms_p50", of.client_ms_p50...);
  visit("mbit_per_s", of.mbit_per_s...);
  visit("frames_applied", of.frames_applied...);
  visit("resyncs", of.resyncs...);
  visit("hash_mismatches", of.hash_mismatches...);
  visit("inputs_sent", of.inputs_sent...);
  visit("inputs_refused", of.inputs_refused...);
}

/// The same for all.
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
