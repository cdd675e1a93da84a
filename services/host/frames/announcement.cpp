#include "services/host/frames/announcement.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {
transport::SessionMessage session_message(const HostConfig& config) {
  const StreamConfig& any = config.streams.front();
  transport::SessionMessage session;
  session.session = config.session;
  session.epoch = config.epoch;
  session.capacity = any.layout.capacity;
  session.frame_rate_hz = config.frame_rate_hz;
  session.dt_s = any.lattice.dt_s;
  session.lattice_unit = any.lattice.unit;
  session.up_axis = config.up_axis;
  session.lead = any.layout.lead;
  session.window_ceiling = config.window.value_or(config.window_ceiling);
  session.continues_epoch = config.continues_epoch;
  session.continues_frame = config.continues_frame;
  session.scene = config.scene;
  session.scene_json = config.scene_json;
  session.types = config.types;
  session.features = transport::features_of(any.layout.world);
  for (const StreamConfig& stream : config.streams)
    if (!stream.layout.data.empty()) session.data = stream.layout.data;
  return session;
}

void list_stream(const Stream& stream, transport::SessionMessage& session) {
  transport::StreamMessage listed;
  listed.id.id = static_cast<std::uint32_t>(session.streams.size());
  listed.name = stream.config().name;
  listed.client_cost_ns = stream.measure_client_cost();
  listed.max_delta_bytes = static_cast<std::uint32_t>(stream.payload_bound());
  listed.max_snapshot_bytes = static_cast<std::uint32_t>(stream.snapshot_bound());
  listed.delay_ms = stream.config().delay_ms;
  listed.carries = listed.id.id;
  listed.cap_kbit_s = stream.config().cap_kbit_s;
  listed.layout = stream.config().layout;
  listed.layout_hash = transport::layout_hash(session, listed);
  session.streams.push_back(std::move(listed));
}

void list_offer(std::uint32_t carries, std::uint32_t delay_ms, transport::SessionMessage& session) {
  TANDEM_ASSERT(carries < session.streams.size() && session.streams[carries].carries == carries);
  transport::StreamMessage listed = session.streams[carries];
  listed.id.id = static_cast<std::uint32_t>(session.streams.size());
  listed.delay_ms = delay_ms;
  session.streams.push_back(std::move(listed));
}

}  // namespace tandem::host
