#pragma once
// What happened in a recorded session, as lines for people.

#include <cstdint>
#include <string>
#include <vector>

#include "services/follow/recording/mcap_reader.hpp"

namespace tandem::recording {

struct RecordedEvent {
  std::uint64_t time_ns = 0;  ///< when it was recorded, wall clock, since 1970
  std::string text;           ///< who says it, and what
};

inline constexpr std::size_t kMaxEvents = 500;
inline constexpr std::size_t kMaxEventBytes = 200;

/// The events that Recorder::add_event() wrote, or another program as foxglove.Log in JSON: the first
/// kMaxEvents, by time. Reads only the chunks that hold some. What cannot be read is left out, as a
/// recording plays without.
[[nodiscard]] std::vector<RecordedEvent> read_events(McapReader& reader);

}  // namespace tandem::recording
