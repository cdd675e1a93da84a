#pragma once
// A small session that the tests of the timelines share.

#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem::synthetic {

inline constexpr Epoch kEpoch = 1'700'000'000'000;

inline TimelineConfig config_for(std::string_view codec, std::uint32_t capacity, std::uint32_t max_lead = 1) {
  TimelineConfig config;
  config.capacity = capacity;
  config.type_count = kTypes;
  config.codec = codec;
  config.codec_tables = tables_for(codec);
  config.parameters = {200, 16, 64};
  config.predictor = "ballistic";
  config.max_lead = max_lead;
  return config;
}

inline ServerTimeline server_of(const TimelineConfig& config) {
  return *ServerTimeline::create(config, kEpoch);
}
inline ClientTimeline client_of(const TimelineConfig& config) { return *ClientTimeline::create(config); }

inline std::vector<std::byte> snapshot_of(ServerTimeline& server) {
  std::vector<std::byte> bytes;
  server.snapshot(bytes);
  return bytes;
}

inline Result<void> apply(ClientTimeline& client, const ServerTimeline::FrameResult& frame) {
  return client.apply(frame.frame, frame.last_input, frame.hash, frame.payload);
}

}  // namespace tandem::synthetic
