#pragma once
// Follows one stream, from the first request for a snapshot to the last delta.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/following/joiner.hpp"
#include "sdk/client/following/lag_limit.hpp"
#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/client/following/snapshot_assembly.hpp"
#include "sdk/client/session/resync_reason.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/port.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

/// All data that a client holds for one stream that it plays or joins, with the rules of "Deltas from parts",
/// "Joining" and "Playing" in idl/STATES.md. Sans-I/O except for its subscriptions. It returns losses; the
/// caller decides whether to rejoin. Not thread-safe.
class Follower {
 public:
  /// Minimum time between acknowledgements of a snapshot's parts.
  static constexpr std::int64_t kPartAckNs = 20'000'000;
  /// Time until `joining` is repeated: short after a request, because it may have been lost, then longer and
  /// longer.
  static constexpr std::int64_t kLeastRepeatNs = 50'000'000, kMaxRepeatNs = 250'000'000;
  /// Requests of a join until the buffered deltas are what is wrong.
  static constexpr std::uint32_t kTrustingAsks = 2;
  /// Maximum delay of a scheduled input that a delta counts.
  static constexpr std::int64_t kInputPatienceNs = 250'000'000;

  /// The follower cannot continue with what it holds.
  struct Loss {
    ResyncReason reason;
    Frame frame;             ///< the frame at which the loss showed
    std::string error = {};  ///< the error of the function that refused a message, if any

    [[nodiscard]] std::string text() const;  ///< for the log
  };
  /// The result of a step: done, not yet, or lost.
  struct Step {
    bool done = false;
    std::optional<Loss> loss = {};
  };

  /// Begins to join. `empty`: an empty timeline of the stream's layout. `join_attempts`: earlier attempts of
  /// this client, see Joiner.
  Follower(transport::StreamMessage announced, ClientTimeline empty, double frame_rate_hz,
           std::uint32_t join_attempts, std::int64_t now_ns);
  ~Follower() = default;
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;
  Follower(Follower&&) = delete;
  Follower& operator=(Follower&&) = delete;

  // The way in

  /// Subscribes to the deltas, unless it is subscribed already. Errors: those of ClientPort::open_stream().
  [[nodiscard]] Result<void> open(transport::ClientPort& port, const transport::SessionMessage& session,
                                  transport::ClientId client);
  /// Ends the subscription.
  void close(transport::ClientPort& port) const { port.close_stream(stream_.id.id); }
  /// True if it is time to say `joining` with a new join_attempt(), which a snapshot answers.
  [[nodiscard]] bool ask(std::int64_t now_ns);
  /// No snapshot fits what is buffered, as often as it was asked for.
  [[nodiscard]] bool suspects_deltas() const {
    return joining_ && asks_ > kTrustingAsks && front() != nullptr;
  }
  /// Subscribes to snapshots, until load() has loaded one. Errors: those of ClientPort::open_snapshots().
  [[nodiscard]] Result<void> open_snapshots(transport::ClientPort& port) const {
    return port.open_snapshots(stream_.id.id);
  }
  /// Takes one part of a snapshot of the session's epoch and this stream. Untrusted. Ignored while it is
  /// useless. Here and below, the way in is also that of a snapshot that is fetched while playing.
  SnapshotAssembly::Outcome take(transport::SnapshotMessage&& part, std::int64_t now_ns);
  /// Writes into an acknowledgement that says `joining` which parts of the snapshot came.
  void tell_progress(transport::AckMessage& ack);
  /// The snapshot to load; empty if there is none.
  [[nodiscard]] std::optional<transport::SnapshotMessage> choose_snapshot(std::int64_t now_ns);
  /// Starts playing from a snapshot that choose_snapshot() returned. Errors: those of ClientTimeline::load(),
  /// and kMalformed (its frame is not the announced one); another snapshot is requested then.
  [[nodiscard]] Result<void> load(const transport::SnapshotMessage& snapshot, transport::ClientPort& port,
                                  std::int64_t now_ns);
  /// Rejoins from a new snapshot. The state and the deltas stay until it is loaded.
  void join_again(std::int64_t now_ns);

  // Without a state: see ClientTimeline::pass()

  /// False: deltas are done unread from now on. True: they are read again, once a snapshot was fetched, while
  /// it goes on playing.
  void keep_state(bool on, std::int64_t now_ns);
  /// True while it plays and asks for a snapshot: ask(), take() and tell_progress() are for that then.
  [[nodiscard]] bool fetching() const { return fetching_; }
  /// While fetching: loads a snapshot of choose_snapshot(), and applies what was done unread since then. A
  /// loss: the snapshot or one of those deltas is wrong.
  [[nodiscard]] std::optional<Loss> fetch(const transport::SnapshotMessage& snapshot,
                                          const ScheduledInputs& scheduled, transport::ClientPort& port);

  // Deltas

  /// What it and the port hold may be wrong, or fits no snapshot: ends the subscription, to be opened anew.
  void forget_deltas(transport::ClientPort& port);
  /// Takes one part of a delta of the session's epoch and this stream. Untrusted. Done: the part completed a
  /// delta that follows the previous one.
  [[nodiscard]] Step take(transport::DeltaMessage&& part, std::int64_t now_ns);
  /// While playing: applies the oldest delta. Done: it is applied, its hash was right (unless keep_state()
  /// says that nobody needs it), and it stays front() until pop(). `waited_ns`: time since the last call; it
  /// counts while a scheduled input is missing.
  [[nodiscard]] Step apply_front(const ScheduledInputs& scheduled, std::int64_t waited_ns);
  void pop() {
    TANDEM_ASSERT(front() != nullptr);
    deltas_.pop();
  }
  /// While playing: returns a loss if too many deltas wait for too long.
  [[nodiscard]] std::optional<Loss> check_lag(std::int64_t now_ns);

  // Ahead of the deltas: see ClientTimeline

  bool step(std::uint32_t lead) {
    TANDEM_ASSERT(!joining_);
    return timeline_.step(lead);
  }
  void prepare() {
    TANDEM_ASSERT(!joining_);
    timeline_.prepare();
  }

  [[nodiscard]] const transport::StreamMessage& stream() const { return stream_; }
  [[nodiscard]] const ClientTimeline& timeline() const { return timeline_; }
  /// The oldest complete delta, or null.
  [[nodiscard]] const CompleteDelta* front() const { return deltas_.front(); }
  /// The number of complete deltas that wait.
  [[nodiscard]] std::size_t waiting() const { return deltas_.size(); }
  [[nodiscard]] std::size_t most_waiting() const { return deltas_.high_water(); }
  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] bool joining() const { return joining_; }  ///< false: it plays
  [[nodiscard]] bool misses_input() const { return input_missing_ns_.has_value(); }
  /// A part of the snapshot or, once it is loaded, a delta came, or the join began.
  [[nodiscard]] std::int64_t heard_ns() const { return heard_ns_; }
  /// Restarts heard_ns(): until now nothing could be heard.
  void excuse_silence(std::int64_t now_ns) { heard_ns_ = now_ns; }

  [[nodiscard]] bool asked() const { return joiner_.asked(); }
  [[nodiscard]] std::uint32_t join_attempt() const { return joiner_.attempt(); }
  /// See Joiner.
  void continue_after(std::uint32_t attempt) { joiner_.continue_after(attempt); }
  /// While joining: when ask() or choose_snapshot() may have a new result.
  [[nodiscard]] std::int64_t next_due_ns() const { return joiner_.next_due_ns(); }
  /// While joining: time from one acknowledgement to the next.
  [[nodiscard]] std::int64_t repeat_ns() const { return part_unacknowledged_ ? kPartAckNs : repeat_ns_; }

 private:
  /// The oldest delta that a snapshot can be followed by.
  [[nodiscard]] const CompleteDelta* oldest() const;
  [[nodiscard]] bool too_old(Frame frame_of_snapshot) const;
  void keep_unread(const CompleteDelta& delta);
  void stop_fetching();
  [[nodiscard]] Step wait_for_inputs(Frame frame, std::int64_t waited_ns);

  transport::StreamMessage stream_;
  ClientTimeline timeline_;
  DeltaAssembly deltas_;
  SnapshotAssembly snapshot_;  ///< the snapshot that is coming in
  Joiner joiner_;
  LagLimit lag_;
  bool is_open_ = false;  ///< open in the port
  bool joining_ = true;
  bool keeps_state_ = true;
  bool fetching_ = false;
  std::deque<CompleteDelta> unread_;  ///< while fetching: done since then, without a gap
  std::size_t unread_bytes_ = 0;
  bool part_unacknowledged_ = false;  ///< a part of the incoming snapshot is not acknowledged yet
  std::int64_t repeat_ns_ = kLeastRepeatNs;
  std::int64_t heard_ns_ = 0;
  /// How long the front delta has waited for a scheduled input.
  std::optional<std::int64_t> input_missing_ns_;
  std::uint32_t asks_ = 0;  ///< of this join
};

}  // namespace tandem::client
