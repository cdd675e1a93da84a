#include "services/host/publication.hpp"

#include <algorithm>
#include <utility>

#include "sdk/transport/limits.hpp"

namespace tandem::host {

transport::SessionMessage session_message(const HostConfig& config, const Stream& stream) {
  const StreamConfig& of_stream = stream.config();
  const Layout& layout = of_stream.layout;
  transport::SessionMessage session;
  session.session = config.session;
  session.epoch = config.epoch;
  session.capacity = layout.capacity;
  session.frame_rate_hz = config.frame_rate_hz;
  session.lattice_unit = of_stream.lattice.unit;
  session.lead = layout.lead;
  session.window_ceiling = config.window.value_or(config.window_ceiling);
  session.scene = config.scene;
  session.scene_description = config.scene_description;
  session.types = config.types;
  transport::StreamMessage announced;
  announced.client_cost_ns = stream.measure_client_cost();
  announced.max_delta_bytes = static_cast<std::uint32_t>(stream.payload_bound());
  announced.max_snapshot_bytes = static_cast<std::uint32_t>(stream.snapshot_bound());
  announced.layout = layout;
  announced.layout_hash = transport::layout_hash(session, announced);
  session.streams.push_back(std::move(announced));
  return session;
}

void push_delta(Outbox& outbox, Epoch epoch, const FrameSource::Made& frame, std::int64_t wall_ns) {
  const std::size_t size = frame.payload.size();
  const std::size_t parts =
      std::max<std::size_t>((size + transport::kPartBytes - 1) / transport::kPartBytes, 1);
  for (std::size_t part = 0; part < parts; ++part) {
    const auto bytes = frame.payload.subspan(
        part * transport::kPartBytes, std::min(transport::kPartBytes, size - part * transport::kPartBytes));
    transport::DeltaMessage delta;
    delta.epoch = epoch;
    delta.frame = frame.frame;
    delta.part = static_cast<std::uint32_t>(part);
    delta.parts = static_cast<std::uint32_t>(parts);
    delta.last_input = frame.last_input;
    delta.server_time_ns = wall_ns;
    delta.hash = frame.hash;
    delta.payload.assign(bytes.begin(), bytes.end());
    // There is room: the caller made sure of it, and its thread is the only producer.
    static_cast<void>(outbox.push(std::move(delta)));
  }
}

}  // namespace tandem::host
