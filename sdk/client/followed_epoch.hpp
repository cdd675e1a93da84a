#pragma once
// One epoch of a session, followed: it takes messages, joins, plays and changes the stream. A new epoch is a
// new object, so nothing of the old one can survive.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/drawing/local_echo.hpp"
#include "sdk/client/drawing/picture_writer.hpp"
#include "sdk/client/drawing/server_clock.hpp"
#include "sdk/client/drawing/uncorrected.hpp"
#include "sdk/client/early.hpp"
#include "sdk/client/following/follower.hpp"
#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/client/following/stream_change.hpp"
#include "sdk/client/lasting.hpp"
#include "sdk/client/session/stream_choice.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/port.hpp"
#include "tandem/client_types.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

/// The rules of idl/STATES.md for the epoch of one server. It chooses a stream, joins and plays it, and may
/// change to another one meanwhile. Every buffer is bounded. Not thread-safe.
class FollowedEpoch {
 public:
  /// A stream is left after so many joins in a row that each ended with a state other than the server's
  /// within so many frames: this client computes it otherwise, and would join for ever.
  static constexpr std::uint32_t kMaxWrongJoins = 3;
  static constexpr std::uint64_t kSettledFrames = 30;

  /// Chooses a stream of an announced session. `client` must outlive the epoch. `unproven`: another
  /// participant announced the epoch before. Errors: why the session cannot be played.
  [[nodiscard]] static Result<std::unique_ptr<FollowedEpoch>> begin(
      const transport::Received<transport::SessionMessage>& announced, Lasting& client, bool unproven,
      Now now);
  ~FollowedEpoch() = default;
  FollowedEpoch(const FollowedEpoch&) = delete;
  FollowedEpoch& operator=(const FollowedEpoch&) = delete;

  // A poll, in this order

  /// Passes the server over if it has been silent for too long. The time since the last poll: while the
  /// client joins, and in general.
  void count_silence(std::int64_t joining_ns, std::int64_t any_ns);
  /// Leaves a stream that this client computes otherwise than the server. An error: there is no other, or
  /// none within the client's cap.
  [[nodiscard]] Result<void> leave_unplayable(Now now);
  /// Takes what arrived and does what is due. `since_ns`: time since the last poll.
  void poll(Now now, std::int64_t since_ns);
  /// See ClientCore::prepare().
  void prepare();
  /// Nothing needs to be asked again: every event wakes the client.
  [[nodiscard]] bool is_calm() const { return !change_ && !played().joining() && !played().misses_input(); }
  [[nodiscard]] std::int64_t next_due_ns(Now now) const;

  // Announcements

  /// Another server may go on with the epoch.
  [[nodiscard]] bool may_go_on() const { return !played().joining(); }
  /// Other streams of the epoch: the stream that is followed goes on, if it still exists. Errors: as begin().
  [[nodiscard]] Result<void> adopt_streams(const transport::SessionMessage& session, Now now);
  /// The client joined the network anew: who announces the epoch next goes on with it.
  void expect_announcement();
  /// A server goes on with the epoch. `is_another`: than the one before. take_early() follows.
  void go_on_under(const transport::ParticipantId& server, bool is_another);
  /// Takes the messages that the new server sent while the old one still counted as alive.
  void take_early(Now now);
  /// Another participant announced the epoch before, and nothing came from this one yet.
  [[nodiscard]] bool unproven() const { return unproven_; }

  // What the application does

  void prefer(const StreamPreference& preference) { chooser_.prefer(preference); }
  /// Shows a gravity that this client sent.
  void echo(const transport::InputMessage& gravity, Now now);
  /// An input acted, was refused or is lost.
  void on_over(std::uint64_t number) { echo_.on_over(number); }
  /// Somebody samples from now on.
  void start_sampling(std::int64_t now_ns);
  /// Shows the bodies without corrections from the current agreed state on, if Lasting::shows_uncorrected
  /// says so. While it joins, that waits for the snapshot.
  void follow_uncorrected();

  // What it holds

  [[nodiscard]] ClientPhase phase() const {
    return played().joining() ? ClientPhase::kJoining : ClientPhase::kPlaying;
  }
  [[nodiscard]] Epoch epoch() const { return session_.epoch; }
  [[nodiscard]] std::uint32_t lead() const { return lead_; }
  /// The stream that is played or joined.
  [[nodiscard]] const transport::StreamMessage& stream() const { return played().stream(); }
  /// Null unless it plays.
  [[nodiscard]] const ClientTimeline* timeline() const {
    return played().joining() ? nullptr : &played().timeline();
  }
  [[nodiscard]] const ServerClock& clock() const { return pacer_.clock(); }
  [[nodiscard]] std::uint32_t join_attempt() const;
  /// The newest reply; null before the first.
  [[nodiscard]] const transport::ReplyMessage* reply() const { return reply_ ? &*reply_ : nullptr; }
  [[nodiscard]] std::optional<Drift> drift() const {
    return uncorrected_ && timeline() != nullptr ? std::optional(uncorrected_->drift()) : std::nullopt;
  }
  /// Writes what is of this epoch into a status: for the application, and for monitors.
  void tell(ClientStatus& out) const;
  void tell(transport::ClientStatusMessage& out);

 private:
  /// The messages that a poll takes from the port; kept to reuse the memory.
  struct Inbox {
    std::vector<transport::Received<transport::DeltaMessage>> deltas;
    std::vector<transport::Received<transport::ScheduledInputMessage>> inputs;
    std::vector<transport::Received<transport::SnapshotMessage>> snapshots;
    std::vector<transport::Received<transport::ReplyMessage>> replies;
    std::vector<transport::Received<transport::ServerStatusMessage>> statuses;
  };

  FollowedEpoch(const transport::Received<transport::SessionMessage>& announced, Lasting& client,
                bool unproven, StreamChooser chooser, std::unique_ptr<Follower> first, Now now);

  // followed_epoch.cpp: acknowledgements, status
  void send_ack(Now now);
  [[nodiscard]] std::int64_t next_ack_ns() const;
  void show_clock();
  void check() const;

  // epoch_take.cpp: take messages
  void take_stream(Now now);
  /// The follower of a stream. If the stream is not followed, returns null and counts the message.
  [[nodiscard]] Follower* followed(const StreamId& stream);
  void take_deltas(Now now);
  void take_delta(transport::DeltaMessage&& delta, Now now);
  void take_scheduled();
  void take_scheduled(const transport::ScheduledInputMessage& message);
  void take_snapshots(Now now);
  void take_replies(Now now);
  void take_statuses(Now now);
  void tell_if_only_measured(const transport::ServerStatusMessage& status);

  // epoch_join.cpp: join and rejoin
  /// Returns the snapshot once it is loaded.
  [[nodiscard]] std::optional<transport::SnapshotMessage> join(Follower& to, Now now);
  void open_snapshots(const Follower& to);
  void join_played(Now now);
  void fetch_state(Now now);
  void count(const Follower::Loss& loss);
  /// Handles a loss of the stream that is played or joined.
  void on_loss(const Follower::Loss& loss, Now now);

  // epoch_play.cpp: the hot loop
  void play(Now now, std::int64_t since_last_poll_ns);
  /// Draws what is played as late as its stream's frames may come.
  void pace();
  /// True if the oldest delta came with others, before its time to be drawn.
  [[nodiscard]] bool front_waits(Now now) const;
  void on_applied(const CompleteDelta& delta, std::int64_t cost_ns, Now now);
  void simulate_ahead(Now now);
  void play_ahead(Now now);

  // epoch_change.cpp: choose, change
  [[nodiscard]] static Result<StreamChooser> choose(const transport::SessionMessage& session,
                                                    const std::vector<StreamId>& unplayable, Lasting& client);
  /// The follower of the stream that `chooser` has chosen.
  [[nodiscard]] static Result<std::unique_ptr<Follower>> follow(const transport::SessionMessage& session,
                                                                const StreamChooser& chooser,
                                                                const Lasting& client,
                                                                std::uint32_t join_attempts, Now now);
  [[nodiscard]] Result<std::unique_ptr<Follower>> choose_anew(Now now);
  [[nodiscard]] Result<std::unique_ptr<Follower>> follow_chosen(Now now) const;
  /// Makes the first choice, once enough is known or was waited for. False: not yet.
  [[nodiscard]] bool settle_choice(Now now);
  /// Refuses the session for the client's cap. `needed_kbit_s`: what it would have to be; 0: not known.
  void refuse_for_cap(std::uint32_t needed_kbit_s);
  void tell_stream();
  void consider_streams(Now now);
  void change_stream(Now now);
  /// Joins `other` instead of the stream that is played or joined.
  void join_instead(std::unique_ptr<Follower> other, Now now);
  void follow_change(Now now);
  /// Handles a loss of the stream that the client is changing to.
  void on_loss_in_change(const Follower::Loss& loss, Now now);
  void move_over(Now now);
  void show_other(Frame left_at, Now now);
  void give_up_change(const std::string& why, Now now);

  /// True if a message is of this epoch and not of this server, and was kept.
  template <class M>
  [[nodiscard]] bool is_early(transport::Received<M>& received) {
    if (received.from == server_ || received.message.epoch != session_.epoch || played().joining() ||
        !client_.port.hears_all_servers())
      return false;
    ++client_.statistics.foreign_messages;
    early_.add(std::move(received));
    return true;
  }
  /// True if a message is of this epoch and this server; others are counted.
  template <class M>
  [[nodiscard]] bool belongs(const transport::Received<M>& received) {
    if (received.from != server_) {
      ++client_.statistics.foreign_messages;
      return false;
    }
    if (received.message.epoch != session_.epoch) {
      ++client_.statistics.stale_messages;
      return false;
    }
    silence_ns_ = quiet_ns_ = 0;
    unproven_ = false;
    return true;
  }
  [[nodiscard]] Follower& played() {
    TANDEM_ASSERT(played_ != nullptr);
    return *played_;
  }
  [[nodiscard]] const Follower& played() const {
    TANDEM_ASSERT(played_ != nullptr);
    return *played_;
  }

  Lasting& client_;
  transport::SessionMessage session_;
  transport::ParticipantId server_;
  StreamChooser chooser_;             ///< chooses among the streams of the session
  std::unique_ptr<Follower> played_;  ///< the stream that is played or joined
  /// Until when the first choice waits for statuses; empty: it was made.
  std::optional<std::int64_t> choice_due_ns_;
  bool is_told_ = false;  ///< the stream of `played_` was chosen for good, and told; not joined before
  std::optional<StreamChange> change_;  ///< the change to another stream, while `played_` goes on
  std::uint32_t lead_;                  ///< in force; not above the session's
  ScheduledInputs scheduled_;
  Early early_;
  Pacer pacer_;
  PictureWriter pictures_;
  LocalEcho echo_;
  std::optional<Uncorrected> uncorrected_;  ///< drawn instead of the timeline, while that is wanted
  Inbox inbox_;

  /// Joins of `played_` in a row after which the state soon differed from the server's.
  std::uint32_t wrong_joins_ = 0;
  std::uint64_t frames_since_join_ = 0;
  std::optional<Error> refusal_;      ///< why the session is left at the next poll
  std::vector<StreamId> unplayable_;  ///< streams that this client computes otherwise than the server

  bool unproven_;
  bool has_loaded_ = false;         ///< `played_` holds a state that can be drawn
  std::int64_t silence_ns_ = 0;     ///< time since anything came from the server, counted only while polled
  std::int64_t quiet_ns_ = 0;       ///< the same, and a status of the server counts, too
  std::int64_t join_began_ns_;      ///< when the session was found, or when a loss began a rejoin
  std::int64_t frame_cost_ns_ = 0;  ///< simulation time since the last applied delta
  bool told_too_slow_ = false, told_lag_ = false;
  std::optional<transport::ReplyMessage> reply_;  ///< newest reply
};

}  // namespace tandem::client
