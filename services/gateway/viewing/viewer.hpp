#pragma once
// The data that a gateway keeps for one connection.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "services/follow/following/input_merger.hpp"
#include "services/gateway/viewing/input_tally.hpp"
#include "services/gateway/viewing/live_log.hpp"
#include "services/gateway/viewing/snapshot_parts.hpp"
#include "services/gateway/viewing/viewer_cap.hpp"
#include "services/host/accounts/limits.hpp"
#include "services/host/accounts/outcomes.hpp"
#include "services/host/accounts/reply_schedule.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::gateway {

using ViewerId = following::SenderId;

// Limits per viewer, which are also the maximum bursts.
inline constexpr double kMessagesPerSecond = 200;   ///< a viewer that joins acknowledges 50 times a second
inline constexpr double kOtherInputsPerSecond = 5;  ///< inputs other than gravity

struct Viewer {
  enum class Flow : std::uint8_t {
    kSilent,     ///< has not asked for anything yet
    kWaiting,    ///< gets a snapshot with the next cut
    kFollowing,  ///< gets what is live from `place` on
  };

  ViewerId id = 0;
  bool may_act = true;                  ///< by its token; if not, it is an observer whatever it wants
  transport::ClientId client = 0;       ///< 0: nothing was received yet
  std::uint64_t told_announcement = 0;  ///< number of the newest announcement it was sent
  std::uint64_t told_status = 0;
  accounts::TokenBucket messages{kMessagesPerSecond, kMessagesPerSecond};
  accounts::TokenBucket reports{1, 2};  ///< of its status, for monitors
  accounts::TokenBucket inputs = accounts::kInputs;
  accounts::TokenBucket other_inputs{kOtherInputsPerSecond, kOtherInputsPerSecond};
  accounts::TokenBucket snapshots_again = accounts::kSnapshotsAgain;
  /// The time since which messages have waited without one being taken.
  std::optional<std::int64_t> waiting_since_ns;
  /// The time since which it has acknowledged nothing, although it was told of a session.
  std::optional<std::int64_t> silent_since_ns;
  std::shared_ptr<accounts::TokenBucket> address_inputs;  ///< shared by viewers of an address; null: no limit

  /// How long its frames may wait, in steps of Grouping. What it asks for in between waits, too, so that one
  /// that flips its delay costs nothing.
  static constexpr std::int64_t kDelayKeptNs = 2 * kSecond;
  std::uint32_t delay_steps = 0, wanted_delay_steps = 0;
  std::optional<std::int64_t> delay_changed_ns;
  /// Takes what it wants, if it may by now.
  void adopt_delay(std::int64_t now_ns) {
    if (wanted_delay_steps == delay_steps || (delay_changed_ns && now_ns - *delay_changed_ns < kDelayKeptNs))
      return;
    delay_steps = wanted_delay_steps;
    delay_changed_ns = now_ns;
  }

  ViewerCap cap;

  InputTally tally;  ///< since it was taken last

  /// The data of one epoch; a new epoch starts with a new object, or with carried_over().
  struct InEpoch {
    bool heard = false;  ///< an acknowledgement of this epoch came
    transport::Phase phase = transport::Phase::kJoining;
    transport::Role wanted = transport::Role::kObserver;
    std::int64_t clock_ns = 0;
    std::uint32_t attempt = 0;
    std::optional<std::uint32_t> served_attempt;

    Flow flow = Flow::kSilent;
    LiveLog::Place place = 0;
    /// While silent: the frame that it holds from another connection, or from before the gateway itself
    /// joined anew.
    std::optional<Frame> holds;
    /// The frame that it held when it went on: it gets what it missed since then, however old and large,
    /// until nothing waits for it.
    std::optional<Frame> catches_up_from;
    SnapshotPassage passage;
    bool hurries = false;  ///< an input of its own acted, or an event happened: the log up to here waits for
                           ///< nothing
    LiveLog::Place not_waiting = 0;  ///< what is in front of this place leaves at once

    std::uint64_t highest = 0;             ///< input number taken, whatever the outcome
    std::vector<std::uint64_t> undecided;  ///< inputs without an outcome yet; ascending
    accounts::Outcomes outcomes;
    accounts::ReplySchedule reply;
    transport::Reason once = transport::Reason::kNone;  ///< goes out with the next reply only

    /// Inputs of earlier epochs that did not act. The first reply says so, by its `highest_input` and its
    /// entries.
    std::vector<std::uint64_t> lost;
    /// The highest input of earlier epochs, until that reply.
    std::optional<std::uint64_t> before;

    /// All inputs up to this number have their outcome, and are not lost.
    [[nodiscard]] std::uint64_t decided() const {
      std::uint64_t up_to = undecided.empty() ? highest : undecided.front() - 1;
      if (before) up_to = std::min(up_to, *before);
      for (const std::uint64_t number : lost) up_to = std::min(up_to, number - 1);
      return up_to;
    }
    /// The data of an epoch that shares a history with this one: inputs and their outcomes go on.
    [[nodiscard]] InEpoch carried_over() && {
      InEpoch next;
      next.highest = highest;
      next.before = highest;
      next.undecided = std::move(undecided);
      next.outcomes = std::move(outcomes);
      next.lost = std::move(lost);
      return next;
    }
  } now;
};

}  // namespace tandem::gateway
