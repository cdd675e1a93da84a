#pragma once
// Which stream of an announced session can this build play?

#include <cstddef>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

struct Playable {
  std::size_t stream = 0;  ///< index into SessionMessage::streams
  ClientTimeline timeline;
};

/// Checks version and every declared value, and makes the timeline of the first listed stream whose layout
/// hash and values are right and whose codec and predictor are known. An announcement is untrusted bytes:
/// nothing is allocated from a value of it before that was checked. Errors: kUnsupported (protocol version),
/// kMalformed (a session-wide value out of range); when no stream can be played, what the first one has
/// (kMismatch, kMalformed, kUnsupported, kInvalidArgument), with every stream's reason in the message.
[[nodiscard]] Result<Playable> choose_stream(const transport::SessionMessage& session);

/// The same check of all: indices of the streams that can be played, at least one. Errors: as
/// choose_stream().
[[nodiscard]] Result<std::vector<std::size_t>> playable_streams(const transport::SessionMessage& session);

}  // namespace tandem::client
