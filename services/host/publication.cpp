#include "services/host/publication.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "sdk/transport/limits.hpp"

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

void push_frame(Outbox& outbox, Epoch epoch, const FrameSource::Made& frame, std::int64_t wall_ns) {
  // There is room: the caller made sure of it, and its thread is the only producer.
  for (const FrameSource::MadeDelta& made : frame.deltas) {
    const std::size_t size = made.payload.size();
    const std::size_t parts =
        std::max<std::size_t>((size + transport::kPartBytes - 1) / transport::kPartBytes, 1);
    for (std::size_t part = 0; part < parts; ++part) {
      const auto bytes = made.payload.subspan(
          part * transport::kPartBytes, std::min(transport::kPartBytes, size - part * transport::kPartBytes));
      transport::DeltaMessage delta;
      delta.epoch = epoch;
      delta.stream.id = made.stream;
      delta.frame = frame.frame;
      delta.part = static_cast<std::uint32_t>(part);
      delta.parts = static_cast<std::uint32_t>(parts);
      delta.last_input = frame.last_input;
      delta.server_time_ns = wall_ns;
      delta.hash = made.hash;
      delta.payload.assign(bytes.begin(), bytes.end());
      static_cast<void>(outbox.push(std::move(delta)));
    }
  }
  static_cast<void>(outbox.push(EndOfFrame{}));
}

}  // namespace tandem::host
