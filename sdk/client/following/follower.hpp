#pragma once
// One stream, from the first question for a snapshot to the last delta.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/following/joiner.hpp"
#include "sdk/client/following/lag_limit.hpp"
#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/client/following/snapshot_assembly.hpp"
#include "sdk/client/session/resync_reason.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/messages.hpp"
#include "sdk/transport/port.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

/// All that a client holds of one stream that it plays, or is on the way into, with the rules of "Deltas from
/// parts", "Joining" and "Playing" in idl/STATES.md. Sans-I/O but for its subscriptions. What was
/// lost is returned: whether to join again is for the caller to say. Not thread-safe.
class Follower {
 public:
  /// Acknowledgements of a snapshot's parts are this far apart at least.
  static constexpr std::int64_t kPartAckNs = 20'000'000;
  /// Until `joining` is said again: soon after a question, as it may have been lost, then more and more
  /// seldom.
  static constexpr std::int64_t kLeastRepeatNs = 50'000'000, kMostRepeatNs = 250'000'000;
  /// A scheduled input that a delta promised may be this late.
  static constexpr std::int64_t kInputPatienceNs = 250'000'000;

  /// It cannot go on from what it holds.
  struct Loss {
    ResyncReason reason;
    Frame frame;             ///< at which that showed
    std::string error = {};  ///< of who refused it, if anybody

    [[nodiscard]] std::string text() const;  ///< for the log
  };
  /// Done, or not yet, or no more.
  struct Step {
    bool done = false;
    std::optional<Loss> loss = {};
  };

  /// Joins. `empty`: of the stream's layout; `join_attempts`: of this client before, see Joiner.
  Follower(transport::StreamMessage announced, ClientTimeline empty, double frame_rate_hz,
           std::uint32_t join_attempts, std::int64_t now_ns);
  ~Follower() = default;
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;
  Follower(Follower&&) = delete;
  Follower& operator=(Follower&&) = delete;

  // The way in

  /// Subscribes to the deltas, unless that is done. Errors: those of ClientPort::open_stream().
  [[nodiscard]] Result<void> open(transport::ClientPort& port, const transport::SessionMessage& session,
                                  transport::ClientId client);
  /// Ends what it opened.
  void close(transport::ClientPort& port) const { port.close_stream(stream_.id.id); }
  /// True when it is time to say `joining` with a new join_attempt(), to be answered by a snapshot.
  [[nodiscard]] bool ask(std::int64_t now_ns);
  /// Subscribes to the answer, until load() has one. Errors: those of ClientPort::open_snapshots().
  [[nodiscard]] Result<void> open_snapshots(transport::ClientPort& port) const {
    return port.open_snapshots(stream_.id.id);
  }
  /// One part of a snapshot, of the session's epoch and this stream. Untrusted. Ignored while there is no use
  /// for it.
  SnapshotAssembly::Outcome take(transport::SnapshotMessage&& part, std::int64_t now_ns);
  /// What came of the snapshot so far, into an acknowledgement that says `joining`.
  void tell_progress(transport::AckMessage& ack);
  /// The snapshot to load, if there is one.
  [[nodiscard]] std::optional<transport::SnapshotMessage> choose_snapshot(std::int64_t now_ns);
  /// Plays from a snapshot that choose_snapshot() returned. Errors: those of ClientTimeline::load(),
  /// kMalformed (of another frame than announced); then another is asked for.
  [[nodiscard]] Result<void> load(const transport::SnapshotMessage& snapshot, transport::ClientPort& port,
                                  std::int64_t now_ns);
  /// From a new snapshot. The state and the deltas held stay until that is loaded.
  void join_again(std::int64_t now_ns);

  // Deltas

  /// One part of a delta, of the session's epoch and this stream. Untrusted. Done: it was the last of a delta
  /// that follows the one before.
  [[nodiscard]] Step take(transport::DeltaMessage&& part, std::int64_t now_ns);
  /// While playing: applies the oldest delta held. Done: it is applied, its hash was right, and it stays
  /// front() until pop(). `waited_ns`: since the last call, counted while a scheduled input is missing.
  [[nodiscard]] Step apply_front(const ScheduledInputs& scheduled, std::int64_t waited_ns);
  void pop() { deltas_.pop(); }
  /// While playing: lost when too many deltas wait for too long.
  [[nodiscard]] std::optional<Loss> check_lag(std::int64_t now_ns);

  // Ahead of the deltas: see ClientTimeline

  bool step(std::uint32_t lead) { return timeline_.step(lead); }
  void prepare() { timeline_.prepare(); }

  [[nodiscard]] const transport::StreamMessage& stream() const { return stream_; }
  [[nodiscard]] const ClientTimeline& timeline() const { return timeline_; }
  /// Oldest complete delta, or null.
  [[nodiscard]] const CompleteDelta* front() const { return deltas_.front(); }
  [[nodiscard]] std::size_t waiting() const { return deltas_.size(); }  ///< complete deltas
  [[nodiscard]] std::size_t most_waiting() const { return deltas_.high_water(); }
  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] bool joining() const { return joining_; }  ///< else it plays
  [[nodiscard]] bool misses_input() const { return input_missing_ns_.has_value(); }
  /// A part of the snapshot or, once it is loaded, a delta came, or the join began.
  [[nodiscard]] std::int64_t heard_ns() const { return heard_ns_; }
  /// Until now nothing could be heard.
  void excuse_silence(std::int64_t now_ns) { heard_ns_ = now_ns; }

  [[nodiscard]] bool asked() const { return joiner_.asked(); }
  [[nodiscard]] std::uint32_t join_attempt() const { return joiner_.attempt(); }
  /// See Joiner.
  void continue_after(std::uint32_t attempt) { joiner_.continue_after(attempt); }
  /// While joining: when ask() or choose_snapshot() may have something new to say.
  [[nodiscard]] std::int64_t next_due_ns() const { return joiner_.next_due_ns(); }
  /// While joining: from one acknowledgement to the next.
  [[nodiscard]] std::int64_t repeat_ns() const { return part_unacknowledged_ ? kPartAckNs : repeat_ns_; }

 private:
  [[nodiscard]] bool too_old(Frame frame_of_snapshot) const;
  [[nodiscard]] Step wait_for_inputs(Frame frame, std::int64_t waited_ns);

  transport::StreamMessage stream_;
  ClientTimeline timeline_;
  DeltaAssembly deltas_;
  SnapshotAssembly snapshot_;  ///< coming in
  Joiner joiner_;
  LagLimit lag_;
  bool is_open_ = false;  ///< in the port
  bool joining_ = true;
  bool part_unacknowledged_ = false;  ///< of the snapshot that is coming in
  std::int64_t repeat_ns_ = kLeastRepeatNs;
  std::int64_t heard_ns_ = 0;
  /// How long the front delta has waited for a scheduled input.
  std::optional<std::int64_t> input_missing_ns_;
};

}  // namespace tandem::client
