#pragma once
// The transport port: what a server and a client need from a publish-subscribe middleware. Implementations:
// dds/ (Cyclone DDS), websocket/ (clients of a gateway) and simulated/ (in memory, with seeded loss, delay
// and reordering).

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/standby_messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// A sample and the participant that wrote it.
template <class M>
struct Received {
  M message;
  ParticipantId from;
};

/// What a port counts that makes repairs itself (idl/RELAY.md), since the start.
struct PublishedCounts {
  std::uint64_t asks = 0, asks_refused = 0;          ///< refused: for their rate or their bytes
  std::uint64_t repeated = 0, repeated_bytes = 0;    ///< messages that were sent on request
  std::uint64_t published = 0, published_bytes = 0;  ///< packets to all
  std::uint64_t unpublished = 0;                     ///< messages while nothing could be sent
  std::uint64_t turned_away = 0;                     ///< messages of who found no place
  std::uint64_t malformed = 0;
  std::size_t followers = 0;  ///< programs that follow now
};
struct FollowedCounts {
  std::uint64_t asked = 0;      ///< requests for what was missing
  std::uint64_t repaired = 0;   ///< messages that came on request
  std::uint64_t resumed = 0;    ///< streams that went on from what was kept
  std::uint64_t given_up = 0;   ///< frames that could not be had any more
  std::uint64_t malformed = 0;  ///< messages that break a rule
};

/// A server's endpoints in one session (one DDS partition).
///
/// Thread-safety: writes may come from one thread (the publisher) while takes come from another. Each of the
/// two groups is called from one thread only. Takes append to `out` and never block. They drop samples that
/// break a size limit and count them in `dropped()`.
class ServerPort {
 public:
  virtual ~ServerPort() = default;

  [[nodiscard]] virtual ParticipantId self() const = 0;
  /// The newest session announcement of each other live server in the same partition.
  virtual void take_sessions(std::vector<Received<SessionMessage>>& out) = 0;

  /// Makes writers of deltas for streams 0 .. count - 1, each in its stream_partition(). Call it before the
  /// session is announced, and while no other thread calls the port. The writer of stream 0 exists from the
  /// start; writers that exist stay. `count`: 1 .. kMaxStreams. Errors: kInvalidArgument, kTransport.
  virtual Result<void> open_streams(std::uint32_t count) = 0;

  virtual Result<void> write(const SessionMessage&) = 0;
  /// Writes to the stream message.stream.id. Errors: also kInvalidArgument for a stream that is not open.
  virtual Result<void> write(const DeltaMessage&) = 0;
  virtual Result<void> write(const ScheduledInputMessage&) = 0;
  /// Reaches only that client. Errors: also kInvalidArgument if open_client() was not called for it.
  virtual Result<void> write(ClientId to, const SnapshotMessage&) = 0;
  /// Reaches only the client if open_client() was called for it; otherwise every client of the session.
  virtual Result<void> write(const ReplyMessage&) = 0;
  virtual Result<void> write(const ServerStatusMessage&) = 0;
  /// Bytes that one observer of a stream takes on the network in a second, with all headers and answers, if
  /// it is sent so many messages with deltas of so many bytes a second; 0: not known. Thread-safe.
  [[nodiscard]] virtual double observer_bytes_per_s(double /*messages*/, double /*bytes*/) const { return 0; }
  /// Shows those who heard nothing for a while that this server lives. Call it every 0.1 s or more often. It
  /// belongs to the writes.
  virtual void show_life() {}
  /// Makes the client's own writers of replies and snapshots, in client_partition(). No effect if they exist.
  /// This call and close_client() belong to the writes.
  virtual Result<void> open_client(ClientId client) = 0;
  /// Ends the client's writers, because its account is gone; late readers then get nothing from them.
  virtual void close_client(ClientId client) = 0;

  virtual void take(std::vector<Received<InputMessage>>& out) = 0;
  virtual void take(std::vector<Received<AckMessage>>& out) = 0;
  /// True if the scheduled-input writer, the stream's delta writer and the client's snapshot writer all have
  /// a matched reader in that participant. False for a stream or a client that is not open.
  [[nodiscard]] virtual bool joined(const ParticipantId& participant, ClientId client,
                                    std::uint32_t stream) = 0;
  /// True if the participant still has a live acknowledgement writer.
  [[nodiscard]] virtual bool alive(const ParticipantId& participant) = 0;
  /// True if the participant has a writer of inputs. With DDS Security an observer cannot have one.
  [[nodiscard]] virtual bool acts(const ParticipantId& /*participant*/) { return true; }
  /// True if the network lets nobody but servers announce a session (DDS Security, permissions of NATS).
  [[nodiscard]] virtual bool vouches_for_servers() const { return false; }
  /// True if the participant has ended: it said so, or was silent for longer than its lease.
  [[nodiscard]] virtual bool ended(const ParticipantId& participant) = 0;
  /// Number of samples refused for their size or shape since the start.
  [[nodiscard]] virtual std::uint64_t dropped() const = 0;
  /// Blocks until there may be something to take, or until the timeout. May return early without a reason.
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
  /// Ends a wait() of another thread. Thread-safe.
  virtual void wake() {}
  /// Why nobody can be reached, in one line for people; empty: the transport knows of nothing.
  [[nodiscard]] virtual std::string trouble() const { return {}; }
  /// Connections that were cut since the start; 0 where there are none.
  [[nodiscard]] virtual std::uint64_t connections_lost() const { return 0; }
  /// Empty where the middleware makes the repairs. Thread-safe.
  [[nodiscard]] virtual std::optional<PublishedCounts> counts() const { return std::nullopt; }
  /// What clients report of themselves and of whom they serve, where the transport does not take it to
  /// monitors.
  virtual void take(std::vector<ClientStatusMessage>& /*out*/) {}

  // A live server, with the servers that stand by.

  virtual void take(std::vector<Received<StandbyMessage>>& out) = 0;
  virtual void take(std::vector<Received<CommandMessage>>& out) = 0;
  /// Makes the writer of journals, and a writer of checkpoints for that server. No effect if they exist. This
  /// call and close_standby() belong to the writes.
  virtual Result<void> open_standby(ClientId standby) = 0;
  virtual void close_standby(ClientId standby) = 0;
  /// True if both writers have a matched reader in that participant.
  [[nodiscard]] virtual bool follows(const ParticipantId& participant, ClientId standby) = 0;
  /// Reaches all servers that follow. Errors: also kInvalidArgument, if open_standby() was never called.
  virtual Result<void> write(const JournalMessage&) = 0;
  /// Reaches only that server. Errors: also kInvalidArgument, if open_standby() was not called for it.
  virtual Result<void> write(ClientId to, const CheckpointMessage&) = 0;

  // A server that stands by.

  /// Subscribes to journals, and to checkpoints for `standby`. Call both while no other thread calls the
  /// port.
  virtual Result<void> follow(ClientId standby) = 0;
  virtual void unfollow() = 0;
  virtual void take(std::vector<Received<JournalMessage>>& out) = 0;
  virtual void take(std::vector<Received<CheckpointMessage>>& out) = 0;
  virtual Result<void> write(const StandbyMessage&) = 0;
};

/// How long an announcement is not followed.
enum class PassOver : std::uint8_t {
  kUntilAnnouncedAnew,   ///< it cannot be played
  kWhileThereIsAnother,  ///< nothing comes from it
  kForItsSuccessor,      ///< the same; but only a server that continues its epoch may take its place
};

/// A client's endpoints in one session. All calls from one thread; takes as in ServerPort.
class ClientPort {
 public:
  virtual ~ClientPort() = default;

  [[nodiscard]] virtual ParticipantId self() const = 0;
  /// The announcement to follow, if it is another than before. A client follows one server as long as that
  /// server lives.
  virtual void take_sessions(std::vector<Received<SessionMessage>>& out) = 0;
  /// The last announcement of take_sessions() is useless: others are preferred. No effect if there is no such
  /// other.
  virtual void pass_over_session(PassOver until) = 0;
  /// False if the writer of the session's announcement is gone (the server ended or died).
  [[nodiscard]] virtual bool server_alive() = 0;
  /// True if the server of what is open said that it ends, or is gone and this transport cannot tell why.
  [[nodiscard]] virtual bool server_ended() { return !server_alive(); }
  /// Why no session can be heard of, in one line for people; empty: the transport knows of nothing.
  [[nodiscard]] virtual std::string trouble() { return {}; }
  /// As in ServerPort.
  [[nodiscard]] virtual std::uint64_t connections_lost() const { return 0; }
  [[nodiscard]] virtual std::optional<FollowedCounts> counts() const { return std::nullopt; }
  /// Set once after the transport had to begin anew, as this machine's address changed: servers now know the
  /// client as another participant, which needs this other id. What was open is open again.
  [[nodiscard]] virtual std::optional<ClientId> take_renewal() { return std::nullopt; }
  /// True: whoever sends collects frames for this client alone, by AckMessage::max_delay_ms.
  [[nodiscard]] virtual bool collects() const { return false; }
  /// True: what is open hears every server of the session, so another one that announces the same epoch may
  /// go on where the last one ended. False: another server has to be joined.
  [[nodiscard]] virtual bool hears_all_servers() const { return false; }

  /// Subscribes to the deltas of `stream`, one of the session's, with its limits, in addition to the streams
  /// that are open. With the first stream of an epoch it also subscribes to scheduled inputs, to replies to
  /// `client` and to replies to all clients. A call for another epoch ends what was open. Errors: kTransport;
  /// what was open before stays so.
  virtual Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                                   ClientId client) = 0;
  /// Ends the subscriptions to the deltas and snapshots of one stream.
  virtual void close_stream(std::uint32_t stream) = 0;
  /// Ends all subscriptions that open_stream() and open_snapshots() made.
  virtual void close_streams() = 0;
  /// Subscribes to the snapshots for this client, with the limits of a stream that is open. Close them when
  /// one was taken. No effect if they are open.
  virtual Result<void> open_snapshots(std::uint32_t stream) = 0;
  virtual void close_snapshots(std::uint32_t stream) = 0;

  virtual void take(std::vector<Received<DeltaMessage>>& out) = 0;
  virtual void take(std::vector<Received<ScheduledInputMessage>>& out) = 0;
  virtual void take(std::vector<Received<SnapshotMessage>>& out) = 0;
  virtual void take(std::vector<Received<ReplyMessage>>& out) = 0;
  virtual void take(std::vector<Received<ServerStatusMessage>>& out) = 0;

  virtual Result<void> write(const AckMessage&) = 0;
  virtual Result<void> write(const InputMessage&) = 0;
  virtual Result<void> write(const ClientStatusMessage&) = 0;

  [[nodiscard]] virtual std::uint64_t dropped() const = 0;
  /// Bytes that this client took on the network since the start, in both directions with all headers, as
  /// computed; 0 where it is not known.
  [[nodiscard]] virtual std::uint64_t wire_bytes(std::int64_t /*now_ns*/) const { return 0; }
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
  /// Ends a wait() of another thread. This is the only call that any thread may make.
  virtual void wake() {}
};

/// Checks a session name: 1..64 characters of [A-Za-z0-9._-]. So no wildcard ever reaches a partition name.
[[nodiscard]] Result<void> check_session_name(const std::string& name);

/// The partition of a stream's deltas: SESSION for stream 0, SESSION/k for stream k > 0.
[[nodiscard]] std::string stream_partition(const std::string& session, std::uint32_t stream);

/// The partition of the figures of streams for clients, which want them less often than monitors.
[[nodiscard]] std::string figures_partition(const std::string& session);

/// The partition of a client's snapshots and replies: SESSION/ID, the id as 16 hex digits.
[[nodiscard]] std::string client_partition(const std::string& session, ClientId client);

/// A hash of everything that decides how the bytes of a stream are read, stepped and scaled: its layout, and
/// the session's protocol version and lattice unit. A client that computes another value refuses the stream.
[[nodiscard]] std::uint64_t layout_hash(const SessionMessage& session, const StreamMessage& stream);

}  // namespace tandem::transport
