#include "sdk/client/session/statistics.hpp"

namespace tandem::client {

ClientStatus figures(const Statistics& statistics) {
  ClientStatus out;
  out.frames_applied = statistics.frames_applied;
  out.resyncs = statistics.resyncs;
  out.hash_mismatches = statistics.hash_mismatches;
  out.refused_messages = statistics.refused_messages + statistics.foreign_messages;
  out.payload_bytes = statistics.payload_bytes;
  out.mbit_per_s = statistics.mbit_per_s();
  out.latency_ms_p50 = statistics.latency.quantile_ms(0.5);
  out.latency_ms_p99 = statistics.latency.quantile_ms(0.99);
  out.input_latency_ms_p50 = statistics.input_latency.quantile_ms(0.5);
  out.input_latency_ms_p99 = statistics.input_latency.quantile_ms(0.99);
  out.client_ms_p50 = statistics.frame_cost.quantile_ms(0.5);
  out.client_ms_p99 = statistics.frame_cost.quantile_ms(0.99);
  out.join_ms = static_cast<double>(statistics.join_ns) / 1e6;
  out.stream_changes = statistics.stream_changes;
  out.inputs_sent = statistics.inputs_sent;
  out.inputs_acted = statistics.inputs_acted;
  out.inputs_refused = statistics.inputs_refused;
  out.inputs_unknown = statistics.inputs_unknown;
  out.queue_high_water = static_cast<std::uint32_t>(statistics.queue_high_water);
  return out;
}

}  // namespace tandem::client
