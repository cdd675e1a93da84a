#include "sdk/client/session/status_report.hpp"

#include <utility>

#include "sdk/wire/units.hpp"

namespace tandem::client {

transport::ClientStatusMessage StatusReport::next(const Statistics& statistics, std::int64_t now_ns) {
  const bool first = last_ns_ == 0;
  const double elapsed_s = static_cast<double>(now_ns - std::exchange(last_ns_, now_ns)) / 1e9;
  const std::uint64_t bytes = statistics.payload_bytes - std::exchange(last_bytes_, statistics.payload_bytes);
  const std::uint64_t on_wire = statistics.wire_bytes - std::exchange(last_wire_, statistics.wire_bytes);
  transport::ClientStatusMessage status;
  const ReportedFigures& counted = statistics;
  static_cast<ReportedFigures&>(status) = counted;
  // The figure of the last second, not since the start.
  status.client_ms_p50 = statistics.recent_cost.quantile_ms(0.5);
  status.mbit_per_s = first ? 0 : static_cast<double>(bytes) * 8 / kBitsPerMbit / elapsed_s;
  status.wire_mbit_per_s = first ? 0 : static_cast<double>(on_wire) * 8 / kBitsPerMbit / elapsed_s;
  status.lag_ms = statistics.smoothed_latency_ns / 1e6;
  status.queue_high_water = statistics.queue_high_water;
  return status;
}

}  // namespace tandem::client
