#pragma once
// A bounded queue of what the host wants published. It is the only place where the host's thread meets the
// publisher's.

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <variant>

#include "sdk/wire/port.hpp"

namespace tandem::host {

/// Asks the publisher to open a client's own writers.
struct OpenClient {
  transport::ClientId client = 0;
};
/// Asks the publisher to close a client's own writers.
struct CloseClient {
  transport::ClientId client = 0;
};
/// One part of a snapshot for one client.
struct SnapshotPart {
  transport::ClientId client = 0;
  transport::SnapshotMessage part;
};

/// Asks the publisher to open the writers for a server that stands by.
struct OpenStandby {
  transport::ClientId standby = 0;
};
/// Asks the publisher to close the writer for a server that stands by.
struct CloseStandby {
  transport::ClientId standby = 0;
};
/// One part of a checkpoint for one server that stands by.
struct CheckpointPart {
  transport::ClientId standby = 0;
  transport::CheckpointMessage part;
};

/// Marks the end of a frame: all its deltas, one for each stream that is made, are in front of this.
struct EndOfFrame {};

using Outgoing = std::variant<transport::SessionMessage, transport::DeltaMessage,
                              transport::ScheduledInputMessage, SnapshotPart, transport::ReplyMessage,
                              transport::ServerStatusMessage, OpenClient, CloseClient, OpenStandby,
                              CloseStandby, transport::JournalMessage, CheckpointPart, EndOfFrame>;

/// First in, first out over all kinds of messages, so that an input that is issued before a delta leaves
/// before it. Thread-safe for one producer and one consumer.
class Outbox {
 public:
  struct Limits {
    std::uint32_t frames = 8;        ///< frames, whatever their number of streams and parts
    std::uint32_t snapshots = 512;   ///< parts of snapshots
    std::uint32_t checkpoints = 64;  ///< parts of checkpoints
    std::uint32_t control = 1024;    ///< everything else
  };
  explicit Outbox(const Limits& limits) : limits_(limits) {}

  /// True if there is room for the deltas of `frames` more frames. It stays true until the producer pushes a
  /// frame's end.
  [[nodiscard]] bool has_frame_room(std::uint32_t frames = 1) const;
  [[nodiscard]] bool has_control_room() const;
  [[nodiscard]] bool has_snapshot_room() const;
  [[nodiscard]] bool has_checkpoint_room() const;
  /// Queues a message. Returns false and queues nothing if the message's kind is at its limit. The deltas of
  /// a frame count once, with the frame's end; check has_frame_room() before the first.
  [[nodiscard]] bool push(Outgoing message);

  /// Takes the oldest message; empty after `timeout`. A call means that the message before is written.
  [[nodiscard]] std::optional<Outgoing> pop(std::chrono::nanoseconds timeout);
  /// Wakes a waiting pop().
  void wake();

  [[nodiscard]] std::size_t size() const;
  /// Number of frames with a delta that is pushed and not yet written.
  [[nodiscard]] std::uint32_t unwritten_frames() const;
  /// Bytes of all messages of a kind pushed so far, in their byte form (sdk/wire/cdr.hpp).
  struct Traffic {
    std::uint64_t replies = 0, scheduled_inputs = 0;
  };
  [[nodiscard]] Traffic traffic() const;
  /// Maximum number of messages that were queued at once.
  [[nodiscard]] std::size_t high_water() const;

 private:
  std::uint32_t* count_of(const Outgoing& message, std::uint32_t& limit);
  void weigh(const Outgoing& message);

  mutable std::mutex mutex_;
  std::condition_variable ready_;
  Limits limits_;
  std::deque<Outgoing> queue_;
  std::uint32_t frames_ = 0, snapshots_ = 0, checkpoints_ = 0, control_ = 0;
  std::size_t high_water_ = 0;
  Traffic traffic_;
  transport::Bytes cdr_;  // kept to reuse its memory
};

/// Writes one message. Errors: those of the port.
[[nodiscard]] Result<void> publish(transport::ServerPort& port, const Outgoing& message);

/// Writes everything that is queued, in the caller's thread: for tests and single-threaded hosts. Stops at
/// the first error; that message is lost.
Result<void> drain(Outbox& outbox, transport::ServerPort& port);

}  // namespace tandem::host
