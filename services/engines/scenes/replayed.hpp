#pragma once
// The part of a replayed session's announcement besides its scene.

#include <cstdint>
#include <string>
#include <vector>

namespace tandem::scenes {

/// See Recording in idl/scene.proto.
struct Recording {
  std::uint64_t started_unix_ms = 0;
  double length_s = 0, from_s = 0;
  std::uint64_t from_frame = 0;
  double frame_rate_hz = 0;  ///< > 0
  struct Event {
    double at_s = 0;
    std::string text;
  };
  std::vector<Event> events = {};
};

/// Puts `recording` into the JSON of a scene; the empty text is an empty scene. If the scene has no dt_s,
/// adds that of the recorded frame rate, so that another rate of the replay changes no velocity. Text
/// that is not such JSON stays unchanged.
[[nodiscard]] std::string replayed(const std::string& json, const Recording& recording);

}  // namespace tandem::scenes
