#pragma once
// The transport port: what a server and a client need from a publish-subscribe middleware.
// Implementations: dds/ (Cyclone DDS) and simulated/ (in memory, seeded loss, delay and reordering).

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/transport/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// A sample and the participant that wrote it.
template <class M>
struct Received {
  M message;
  ParticipantId from;
};

/// A server's endpoints in one session (one DDS partition).
///
/// Thread-safety: writes may come from one thread (the publisher) while takes come from another; each of the
/// two groups is called from one thread only. Takes append to `out`, never block, and drop samples that break
/// a size limit, counting them in `dropped()`.
class ServerPort {
 public:
  virtual ~ServerPort() = default;

  [[nodiscard]] virtual ParticipantId self() const = 0;
  /// Session announcements of other live servers in the same partition, newest of each.
  virtual void take_sessions(std::vector<Received<SessionMessage>>& out) = 0;

  /// Writers of deltas for streams 0 .. count - 1, each in its stream_partition(); before the
  /// session is announced, and while nobody else calls the port. Those of stream 0 are there from the start.
  /// `count`: 1 .. kMaxStreams; those that are there stay. Errors: kInvalidArgument, kTransport.
  virtual Result<void> open_streams(std::uint32_t count) = 0;

  virtual Result<void> write(const SessionMessage&) = 0;
  /// By message.stream.id. Errors: also kInvalidArgument, for a stream that is not open.
  virtual Result<void> write(const DeltaMessage&) = 0;
  virtual Result<void> write(const ScheduledInputMessage&) = 0;
  /// Reaches that client alone. Errors: also kInvalidArgument, where open_client() was not called for it.
  virtual Result<void> write(ClientId to, const SnapshotMessage&) = 0;
  /// Reaches the client alone where open_client() was called for it; otherwise every client of the session.
  virtual Result<void> write(const ReplyMessage&) = 0;
  virtual Result<void> write(const ServerStatusMessage&) = 0;
  /// Writers of replies and snapshots of the client's own, in client_partition(). No effect while there are
  /// some. Part of the writes, as is close_client().
  virtual Result<void> open_client(ClientId client) = 0;
  /// Its account is gone: ends its writers, and with them what late readers are handed.
  virtual void close_client(ClientId client) = 0;

  virtual void take(std::vector<Received<InputMessage>>& out) = 0;
  virtual void take(std::vector<Received<AckMessage>>& out) = 0;
  /// The scheduled-input writer, the stream's delta writer and the client's snapshot writer all have a
  /// matched reader in that participant. False for a stream or a client that is not open.
  [[nodiscard]] virtual bool joined(const ParticipantId& participant, ClientId client,
                                    std::uint32_t stream) = 0;
  /// The participant still has a live acknowledgement writer.
  [[nodiscard]] virtual bool alive(const ParticipantId& participant) = 0;
  /// Nothing is left of the participant: it said so itself, or was silent for longer than its lease.
  [[nodiscard]] virtual bool ended(const ParticipantId& participant) = 0;
  /// Samples refused for their size or shape since the start.
  [[nodiscard]] virtual std::uint64_t dropped() const = 0;
  /// Blocks until something may be there to take, or the timeout. Spurious returns are allowed.
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
  /// Ends a wait() of another thread. Thread-safe.
  virtual void wake() {}
};

/// For how long an announcement is not followed.
enum class PassOver : std::uint8_t {
  kUntilAnnouncedAnew,   ///< it cannot be played
  kWhileThereIsAnother,  ///< nothing comes from it
};

/// A client's endpoints in one session. All calls from one thread; takes as in ServerPort.
class ClientPort {
 public:
  virtual ~ClientPort() = default;

  [[nodiscard]] virtual ParticipantId self() const = 0;
  /// The announcement to follow, when it is another than before: one server's for as long as that lives.
  virtual void take_sessions(std::vector<Received<SessionMessage>>& out) = 0;
  /// What take_sessions() handed out last is of no use: others come first.
  virtual void pass_over_session(PassOver until) = 0;
  /// False when the writer of the session's announcement is gone (server ended or died).
  [[nodiscard]] virtual bool server_alive() = 0;

  /// Subscribes to the deltas of `stream`, one of the session's, with its limits, beside those that are open;
  /// with the first of an epoch also to scheduled inputs and to replies to `client` and to everybody. Calling
  /// it for another epoch ends what was open. Errors: kTransport; what was open before stays so.
  virtual Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                                   ClientId client) = 0;
  /// Ends the subscriptions to the deltas and snapshots of one stream.
  virtual void close_stream(std::uint32_t stream) = 0;
  /// Ends all subscriptions that open_stream() and open_snapshots() made.
  virtual void close_streams() = 0;
  /// Subscribes to the snapshots for this client, with the limits of a stream that is open; close when one
  /// was taken. No effect while they are.
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
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
  /// Ends a wait() of another thread. The one call that any thread may make.
  virtual void wake() {}
};

/// Checks a session name: 1..64 characters of [A-Za-z0-9._-]; so no wildcard ever reaches a partition name.
[[nodiscard]] Result<void> check_session_name(const std::string& name);

/// Where the deltas of a stream are: SESSION for stream 0, SESSION/k for stream k > 0.
[[nodiscard]] std::string stream_partition(const std::string& session, std::uint32_t stream);

/// Where the snapshots for a client and the replies to it are: SESSION/ID, the id as 16 hex digits.
[[nodiscard]] std::string client_partition(const std::string& session, ClientId client);

/// Over everything that decides how the bytes of a stream are read, stepped and scaled: its layout and the
/// session's protocol version and lattice unit. A client that computes another value refuses the stream.
[[nodiscard]] std::uint64_t layout_hash(const SessionMessage& session, const StreamMessage& stream);

}  // namespace tandem::transport
