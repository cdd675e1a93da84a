#pragma once
// All that a client holds of one stream that it plays, or is on the way into.

#include <cstdint>
#include <optional>
#include <utility>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/following/joiner.hpp"
#include "sdk/client/following/snapshot_assembly.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/messages.hpp"

namespace tandem::client {

struct FollowedStream {
  /// `join_attempts`: of this client before; see Joiner.
  FollowedStream(transport::StreamMessage announced, ClientTimeline empty, std::uint32_t join_attempts)
      : stream(std::move(announced)),
        timeline(std::move(empty)),
        assembly({.delta_bytes = stream.max_delta_bytes}),
        snapshot(stream.max_snapshot_bytes),
        joiner(join_attempts) {}

  [[nodiscard]] bool too_old(Frame frame_of_snapshot) const {
    const CompleteDelta* first = assembly.front();
    return first != nullptr && frame_of_snapshot + 1 < first->frame;
  }

  transport::StreamMessage stream;
  ClientTimeline timeline;
  DeltaAssembly assembly;
  SnapshotAssembly snapshot;  ///< coming in
  Joiner joiner;
  bool is_open = false;  ///< in the port
  bool joining = true;
  bool part_unacknowledged = false;  ///< of the snapshot that is coming in
  /// Until `joining` is said again: soon after a question, as it may have been lost, then more and more
  /// seldom.
  static constexpr std::int64_t kLeastRepeatNs = 50'000'000, kMostRepeatNs = 250'000'000;
  std::int64_t repeat_ns = kLeastRepeatNs;
  std::int64_t heard_ns = 0;  ///< a part of the snapshot came, or the join began
  /// How long the front delta has waited for a scheduled input.
  std::optional<std::int64_t> input_missing_ns;
};

}  // namespace tandem::client
