#pragma once
// The figures of a server. Each figure is written here once: as a line in a struct and as a line in the list
// below the struct. The status message, the host's totals, tandem::Server, `tandemd --json`, the browser and
// `tandem top` use the lists. In Tandem's sources, CONTRIBUTING.md says under "Where a new thing goes" where
// else a new figure has to be named and what checks it.

#include <cstdint>

namespace tandem {

// sdk/package/figures.py reads the structs: each figure is one line, followed by its text.

/// Counts since the start. They are sums over all streams where streams differ.
struct ServerCounts {
  std::uint64_t reply_bytes = 0;       ///< size of replies as messages
  std::uint64_t input_bytes = 0;       ///< size of scheduled inputs as messages
  std::uint64_t snapshot_bytes = 0;    ///< size of the snapshots, including repetitions
  std::uint64_t stalls = 0;            ///< suspensions that a participant caused
  std::uint64_t suspended_ms = 0;      ///< time that due frames waited for participants or the queue
  std::uint64_t refused_inputs = 0;    ///< refused by a rule, by the rate limit or by the simulation
  std::uint64_t refused_messages = 0;  ///< messages that broke a rule of the protocol
  std::uint64_t snapshots = 0;         ///< snapshots made for joining clients
  bool operator==(const ServerCounts&) const = default;
};

/// What TandemServerStatus tells about one stream once a second. Rates and durations are of the last second.
/// Bytes are counted since the start, as handed to the writers: once, however many readers there are.
struct ServerFigures : ServerCounts {
  double uptime_s = 0;                 ///< since the start
  double frame_rate_hz = 0;            ///< as achieved
  double mbit_per_s = 0;               ///< payload rate; 1 Mbit = 2^20 bits
  double wire_mbit_per_s = 0;          ///< what one observer takes on the network, computed; 0: not known
  double raw_mbit_per_s = 0;           ///< rate of the stream's channels, uncompressed
  double frame_ms_p50 = 0;             ///< step, predict, encode, apply
  double frame_ms_p99 = 0;             ///< as frame_ms_p50
  double corrected_per_frame = 0;      ///< bodies that a delta corrects
  double threshold = 0;                ///< in force, scene units
  std::uint32_t bodies = 0;            ///< bodies alive
  std::uint32_t at_rest = 0;           ///< bodies at rest
  std::uint32_t participants = 0;      ///< participants that play
  std::uint32_t observers = 0;         ///< observers that play
  std::uint32_t window = 0;            ///< maximum number of frames that a participant may be behind
  std::uint32_t queue_high_water = 0;  ///< maximum number of messages that waited at once
  std::uint64_t delta_bytes = 0;       ///< size of the deltas' payload
  bool operator==(const ServerFigures&) const = default;
};

/// Calls visit("name", that figure of each of `of`) for one figure after the other, in the order of
/// idl/tandem.idl. The structs in `of` may be of any type with these members: of the IDL, or several to copy
/// from one to the other.
template <class Visit, class... Of>
constexpr void each_server_count(const Visit& visit, Of&... of) {
  visit("reply_bytes", of.reply_bytes...);
  visit("input_bytes", of.input_bytes...);
  visit("snapshot_bytes", of.snapshot_bytes...);
  visit("stalls", of.stalls...);
  visit("suspended_ms", of.suspended_ms...);
  visit("refused_inputs", of.refused_inputs...);
  visit("refused_messages", of.refused_messages...);
  visit("snapshots", of.snapshots...);
}

/// Does the same for all figures.
template <class Visit, class... Of>
constexpr void each_server_figure(const Visit& visit, Of&... of) {
  visit("uptime_s", of.uptime_s...);
  visit("frame_rate_hz", of.frame_rate_hz...);
  visit("mbit_per_s", of.mbit_per_s...);
  visit("wire_mbit_per_s", of.wire_mbit_per_s...);
  visit("raw_mbit_per_s", of.raw_mbit_per_s...);
  visit("frame_ms_p50", of.frame_ms_p50...);
  visit("frame_ms_p99", of.frame_ms_p99...);
  visit("corrected_per_frame", of.corrected_per_frame...);
  visit("threshold", of.threshold...);
  visit("bodies", of.bodies...);
  visit("at_rest", of.at_rest...);
  visit("participants", of.participants...);
  visit("observers", of.observers...);
  visit("window", of.window...);
  visit("queue_high_water", of.queue_high_water...);
  visit("delta_bytes", of.delta_bytes...);
  each_server_count(visit, of...);
}

}  // namespace tandem
