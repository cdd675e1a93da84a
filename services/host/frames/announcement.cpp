#include "services/host/frames/announcement.hpp"

#include <string>
#include <utility>
#include <vector>

namespace tandem::host {
namespace {

// In protobuf text (idl/scene.proto, stream_names); names need no escapes.
std::string with_stream_names(std::string description, const std::vector<StreamConfig>& streams) {
  if (streams.front().name.empty()) return description;
  if (!description.empty() && description.back() != '\n') description += '\n';
  for (const StreamConfig& stream : streams) description += "stream_names: \"" + stream.name + "\"\n";
  return description;
}

}  // namespace

transport::SessionMessage session_message(const HostConfig& config) {
  const StreamConfig& any = config.streams.front();
  transport::SessionMessage session;
  session.session = config.session;
  session.epoch = config.epoch;
  session.capacity = any.layout.capacity;
  session.frame_rate_hz = config.frame_rate_hz;
  session.lattice_unit = any.lattice.unit;
  session.lead = any.layout.lead;
  session.window_ceiling = config.window.value_or(config.window_ceiling);
  session.scene = config.scene;
  session.scene_description = with_stream_names(config.scene_description, config.streams);
  session.types = config.types;
  return session;
}

void list_stream(const Stream& stream, transport::SessionMessage& session) {
  transport::StreamMessage listed;
  listed.id.id = static_cast<std::uint32_t>(session.streams.size());
  listed.client_cost_ns = stream.measure_client_cost();
  listed.max_delta_bytes = static_cast<std::uint32_t>(stream.payload_bound());
  listed.max_snapshot_bytes = static_cast<std::uint32_t>(stream.snapshot_bound());
  listed.layout = stream.config().layout;
  listed.layout_hash = transport::layout_hash(session, listed);
  session.streams.push_back(std::move(listed));
}

}  // namespace tandem::host
