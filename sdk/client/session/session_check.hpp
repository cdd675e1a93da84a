#pragma once
// Finds the streams of an announced session that this build can play.

#include <cstddef>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

struct Playable {
  std::size_t stream = 0;  ///< index into SessionMessage::streams
  ClientTimeline timeline;
};

/// Checks version and every declared value, and makes the timeline of the first listed stream whose layout
/// hash and values are right and whose codec and predictor are known. An announcement is untrusted: no value
/// of it causes an allocation before it was checked. Errors: kUnsupported (protocol version), kMalformed (a
/// session-wide value out of range). If no stream can be played, the code is the first one's (kMismatch,
/// kMalformed, kUnsupported, kInvalidArgument), and the message has every stream's reason.
[[nodiscard]] Result<Playable> choose_stream(const transport::SessionMessage& session);

/// Does the same checks for all streams. Returns the indices of the streams that can be played, at least one.
/// Errors: as choose_stream().
[[nodiscard]] Result<std::vector<std::size_t>> playable_streams(const transport::SessionMessage& session);

}  // namespace tandem::client
