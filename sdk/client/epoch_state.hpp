#pragma once
// All data that a client holds for one epoch. A new epoch is a new object, so nothing of the old one can
// survive.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "sdk/client/drawing/local_echo.hpp"
#include "sdk/client/drawing/picture_writer.hpp"
#include "sdk/client/drawing/server_clock.hpp"
#include "sdk/client/drawing/uncorrected.hpp"
#include "sdk/client/following/follower.hpp"
#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/client/following/stream_change.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::client {

/// Messages of this epoch from a participant that is not the followed server, kept while that server counts
/// as alive. The sender may turn out to be its heir. Only the latest are kept.
struct Early {
  static constexpr std::size_t kMost = 2048, kMostBytes = 16U << 20U;
  std::deque<transport::Received<transport::DeltaMessage>> deltas;
  std::deque<transport::Received<transport::ScheduledInputMessage>> inputs;
  std::size_t bytes = 0;  ///< of the deltas

  void add(transport::Received<transport::DeltaMessage>&& delta) {
    bytes += delta.message.payload.size();
    deltas.push_back(std::move(delta));
    while (deltas.size() > kMost || bytes > kMostBytes) {
      bytes -= deltas.front().message.payload.size();
      deltas.pop_front();
    }
  }
  void add(transport::Received<transport::ScheduledInputMessage>&& input) {
    inputs.push_back(std::move(input));
    if (inputs.size() > kMost) inputs.pop_front();
  }
};

struct EpochState {
  EpochState(transport::SessionMessage announced, const transport::ParticipantId& announced_by,
             std::unique_ptr<Follower> first, std::uint32_t wanted_lead, PictureExchange& exchange)
      : session(std::move(announced)),
        server(announced_by),
        played(std::move(first)),
        lead(std::min(wanted_lead, session.lead)),
        pacer(session.frame_rate_hz),
        pictures(exchange, session) {}

  transport::SessionMessage session;
  transport::ParticipantId server;
  std::unique_ptr<Follower> played;  ///< the stream that is played or joined; never null
  bool is_chosen = false;  ///< the stream of `played` was chosen for good, and told; not joined before
  std::optional<StreamChange> change;  ///< the change to another stream, while `played` goes on
  std::uint32_t lead;                  ///< in force; not above the session's
  ScheduledInputs scheduled;
  Early early;
  Pacer pacer;
  PictureWriter pictures;
  LocalEcho echo;
  std::optional<Uncorrected> uncorrected;  ///< drawn instead of the timeline, while that is wanted

  /// Joins of `played` in a row after which the state soon differed from the server's.
  std::uint32_t wrong_joins = 0;
  std::uint64_t frames_since_join = 0;
  std::vector<StreamId> unplayable;  ///< streams that this client computes otherwise than the server

  /// Another participant announced the epoch before, and nothing came from this one yet.
  bool unproven = false;
  bool has_loaded = false;         ///< `played` holds a state that can be drawn
  std::int64_t silence_ns = 0;     ///< time since anything came from the server, counted only while polled
  std::int64_t quiet_ns = 0;       ///< the same, and a status of the server counts, too
  std::int64_t join_began_ns = 0;  ///< when the session was found, or when a loss began a rejoin
  std::int64_t frame_cost_ns = 0;  ///< simulation time since the last applied delta
  bool told_too_slow = false, told_lag = false;
  std::optional<transport::ReplyMessage> reply;  ///< newest reply
};

}  // namespace tandem::client
