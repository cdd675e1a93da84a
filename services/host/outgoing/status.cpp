#include "services/host/outgoing/status.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/outgoing/wire_cap.hpp"

namespace tandem::host {

void StatusDesk::publish(const HostTotals& totals, const Present& present, std::int64_t now_ns) {
  TANDEM_ASSERT(stream_ < totals.streams.size() && totals.frames >= second_.frames);
  next_ns_ = now_ns + (present.made ? kPeriodNs : kIdlePeriodNs);
  const double elapsed_s = std::max(static_cast<double>(now_ns - second_ns_) * 1e-9, 1e-9);
  const auto frames = static_cast<double>(totals.frames - second_.frames);
  const StreamTotals& stream = totals.streams[stream_];
  const StreamTotals before = second_.streams.empty() ? StreamTotals{} : second_.streams[stream_];
  if (present.made) {
    const auto made = static_cast<double>(stream.frames - before.frames);
    wire_mbit_per_s_ = port_->observer_bytes_per_s(
                           static_cast<double>(stream.messages - before.messages) / elapsed_s,
                           static_cast<double>(stream.message_bytes - before.message_bytes) / elapsed_s) *
                       8 / kBitsPerMbit;
    mbit_per_s_ =
        static_cast<double>(stream.payload_bytes - before.payload_bytes) * 8 / kBitsPerMbit / elapsed_s;
    threshold_m_ = present.threshold_m;
    corrected_per_frame_ = made > 0 ? static_cast<double>(stream.corrected - before.corrected) / made : 0;
  }
  if (!present.made && present.estimated_mbit_per_s > 0) {
    mbit_per_s_ = present.estimated_mbit_per_s;
    const double bytes = mbit_per_s_ * kBitsPerMbit / 8 + present.messages_per_s * WireCap::kFieldBytes;
    wire_mbit_per_s_ = port_->observer_bytes_per_s(present.messages_per_s, bytes) * 8 / kBitsPerMbit;
  }
  transport::ServerStatusMessage status;
  const ServerCounts& counts = totals;
  static_cast<ServerCounts&>(status) = counts;
  status.snapshot_bytes = stream.snapshot_bytes;
  status.snapshots = stream.snapshots;
  status.session = session_;
  status.stream = stream_;
  status.epoch = epoch_;
  status.frame = present.frame;
  status.uptime_s = static_cast<double>(now_ns - started_ns_) * 1e-9;
  status.frame_rate_hz = frames / elapsed_s;
  status.mbit_per_s = mbit_per_s_;
  const auto raw_bytes = double{1} * present.bodies * present.raw_body_bytes;
  status.wire_mbit_per_s = wire_mbit_per_s_;
  status.raw_mbit_per_s = raw_bytes * 8 * status.frame_rate_hz / kBitsPerMbit;
  status.frame_ms_p50 = durations_.quantile_ms(0.5);
  status.frame_ms_p99 = durations_.quantile_ms(0.99);
  status.corrected_per_frame = corrected_per_frame_;
  // A stream that is not made begins with another than it had last.
  status.threshold = threshold_m_ > 0 ? threshold_m_ : present.threshold_m;
  status.codec = present.codec;
  status.predictor = present.predictor;
  status.bodies = present.bodies;
  status.at_rest = present.at_rest;
  status.participants = present.participants;
  status.observers = present.observers;
  status.window = present.window;
  status.delta_bytes = stream.payload_bytes;
  status.queue_high_water = static_cast<std::uint32_t>(outbox_->high_water());
  if (!outbox_->push(std::move(status))) return;
  second_ = totals;
  second_ns_ = now_ns;
  durations_.clear();
}

}  // namespace tandem::host
