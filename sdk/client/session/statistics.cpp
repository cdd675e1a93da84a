#include "sdk/client/session/statistics.hpp"

namespace tandem::client {

ClientStatus figures(const Statistics& statistics) {
  ClientStatus out;
  const ClientFigures& counted = statistics;
  static_cast<ClientFigures&>(out) = counted;
  out.refused_messages += statistics.foreign_messages;
  out.mbit_per_s = statistics.mean_mbit_per_s();
  out.wire_mbit_per_s = statistics.mean_wire_mbit_per_s();
  out.latency_ms_p50 = statistics.latency.quantile_ms(0.5);
  out.latency_ms_p99 = statistics.latency.quantile_ms(0.99);
  out.input_latency_ms_p50 = statistics.input_latency.quantile_ms(0.5);
  out.input_latency_ms_p99 = statistics.input_latency.quantile_ms(0.99);
  out.client_ms_p50 = statistics.frame_cost.quantile_ms(0.5);
  out.client_ms_p99 = statistics.frame_cost.quantile_ms(0.99);
  out.join_ms = static_cast<double>(statistics.join_ns) / 1e6;
  return out;
}

}  // namespace tandem::client
