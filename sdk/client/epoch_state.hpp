#pragma once
// All that a client holds of one epoch. A new epoch is a new object, so nothing can survive from the old one.

#include <cstdint>
#include <optional>

#include "sdk/client/delta_assembly.hpp"
#include "sdk/client/joiner.hpp"
#include "sdk/client/lag_limit.hpp"
#include "sdk/client/local_echo.hpp"
#include "sdk/client/picture_writer.hpp"
#include "sdk/client/scheduled_inputs.hpp"
#include "sdk/client/server_clock.hpp"
#include "sdk/client/session_check.hpp"
#include "sdk/client/snapshot_assembly.hpp"
#include "sdk/client/uncorrected.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/messages.hpp"

namespace tandem::client {

struct EpochState {
  EpochState(transport::SessionMessage announced, const transport::ParticipantId& announced_by,
             Playable playable, std::uint32_t wanted_lead, std::uint32_t join_attempts,
             PictureExchange& exchange)
      : session(std::move(announced)),
        stream(session.streams[playable.stream]),
        server(announced_by),
        timeline(std::move(playable.timeline)),
        lead(std::min(wanted_lead, session.lead)),
        assembly({.delta_bytes = stream.max_delta_bytes}),
        snapshot(stream.max_snapshot_bytes),
        joiner(join_attempts),
        lag(session.frame_rate_hz),
        pacer(session.frame_rate_hz),
        pictures(exchange, session) {}

  transport::SessionMessage session;
  transport::StreamMessage stream;  ///< the one that is played
  transport::ParticipantId server;
  ClientTimeline timeline;
  std::uint32_t lead;  ///< in force: not above the session's
  DeltaAssembly assembly;
  SnapshotAssembly snapshot;  ///< coming in
  /// Acknowledgements of its parts are this far apart at least.
  static constexpr std::int64_t kPartAckNs = 20'000'000;
  bool part_unacknowledged = false;
  ScheduledInputs scheduled;
  Joiner joiner;
  LagLimit lag;
  Pacer pacer;
  PictureWriter pictures;
  LocalEcho echo;
  std::optional<Uncorrected> uncorrected;  ///< drawn instead of the timeline, while somebody wants that

  bool stream_open = false;
  bool joining = true;
  bool played = false;             ///< has been playing in this epoch
  std::int64_t silence_ns = 0;     ///< time with polls since anything came from the server
  std::int64_t join_began_ns = 0;  ///< the session was learned, or something was lost
  /// How long the front delta has waited for a scheduled input.
  std::optional<std::int64_t> input_missing_ns;
  std::int64_t frame_cost_ns = 0;  ///< simulation since the last applied delta
  bool told_too_slow = false, told_lag = false;
  std::optional<transport::ReplyMessage> reply;  ///< newest
};

}  // namespace tandem::client
