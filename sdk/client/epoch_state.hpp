#pragma once
// All that a client holds of one epoch. A new epoch is a new object, so nothing can survive from the old one.

#include <cstdint>
#include <optional>

#include "sdk/client/drawing/local_echo.hpp"
#include "sdk/client/drawing/picture_writer.hpp"
#include "sdk/client/drawing/server_clock.hpp"
#include "sdk/client/drawing/uncorrected.hpp"
#include "sdk/client/following/followed_stream.hpp"
#include "sdk/client/following/lag_limit.hpp"
#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/transport/messages.hpp"

namespace tandem::client {

struct EpochState {
  EpochState(transport::SessionMessage announced, const transport::ParticipantId& announced_by,
             FollowedStream first, std::uint32_t wanted_lead, PictureExchange& exchange)
      : session(std::move(announced)),
        server(announced_by),
        played(std::move(first)),
        lead(std::min(wanted_lead, session.lead)),
        lag(session.frame_rate_hz),
        pacer(session.frame_rate_hz),
        pictures(exchange, session) {}

  transport::SessionMessage session;
  transport::ParticipantId server;
  FollowedStream played;               ///< or joined
  std::optional<FollowedStream> next;  ///< on the way into it, while the other is played
  std::uint32_t lead;                  ///< in force: not above the session's
  /// Acknowledgements of a snapshot's parts are this far apart at least.
  static constexpr std::int64_t kPartAckNs = 20'000'000;
  ScheduledInputs scheduled;
  LagLimit lag;
  Pacer pacer;
  PictureWriter pictures;
  LocalEcho echo;
  std::optional<Uncorrected> uncorrected;  ///< drawn instead of the timeline, while somebody wants that

  bool has_played = false;         ///< in this epoch
  std::int64_t silence_ns = 0;     ///< time with polls since anything came from the server
  std::int64_t join_began_ns = 0;  ///< the session was learned, or something was lost
  std::int64_t frame_cost_ns = 0;  ///< simulation since the last applied delta
  bool told_too_slow = false, told_lag = false;
  std::optional<transport::ReplyMessage> reply;  ///< newest
};

}  // namespace tandem::client
