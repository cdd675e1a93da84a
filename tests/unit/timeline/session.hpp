#pragma once
// A small session that the tests of the timelines share.

#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem::synthetic {

inline constexpr Epoch kEpoch = 1'700'000'000'000;

inline Layout layout_for(std::string_view codec, std::uint32_t capacity, std::uint32_t lead = 1) {
  Layout layout;
  layout.capacity = capacity;
  layout.type_count = kTypes;
  layout.codec = codec;
  layout.codec_tables = tables_for(codec);
  layout.parameters = {{200, 16, 64}};
  layout.predictor = "ballistic";
  layout.lead = lead;
  return layout;
}

inline ServerTimeline server_of(const Layout& layout) { return *ServerTimeline::create(layout, kEpoch); }
inline ClientTimeline client_of(const Layout& layout) { return *ClientTimeline::create(layout); }

inline std::vector<std::byte> snapshot_of(ServerTimeline& server) {
  std::vector<std::byte> bytes;
  server.snapshot(bytes);
  return bytes;
}

inline Result<void> apply(ClientTimeline& client, const ServerTimeline::FrameResult& frame) {
  return client.apply(frame.frame, frame.last_input, frame.hash, frame.payload);
}

}  // namespace tandem::synthetic
