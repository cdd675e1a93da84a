#pragma once
// A client's port onto one gateway, without a socket: bytes of WebSocket messages go in and come out.
// idl/PROTOCOL.md, "WebSocket".

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "sdk/wire/envelope.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/port.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// Queues between a ClientCore and the owner of the connection. Every queue is bounded. Not thread-safe.
class WebPort final : public ClientPort {
 public:
  /// Maximum size of a WebSocket message; the owner of the connection refuses a larger one before it is
  /// copied.
  static constexpr std::size_t kMaxMessageBytes = kMaxDeltaBytes + (1U << 16U);
  /// Decoded bytes that wait in one queue; what comes beyond it is dropped, and the client joins again. A
  /// message that waits alone always has room.
  static constexpr std::size_t kMaxQueuedBytes = kMaxSampleBytes + (1U << 16U);
  static constexpr std::size_t kMaxQueuedOut = 256;  ///< messages that wait to be sent

  /// A connection was opened. It counts as a participant of its own. A client that plays goes on over it with
  /// what it holds, if the gateway announces the same epoch. `anew`: it joins, whatever is announced.
  void connected(bool anew = false);
  /// It is closed; nothing can be written until the next one. What was not taken is void; what is open stays
  /// so.
  void disconnected();
  [[nodiscard]] bool is_connected() const { return connected_; }

  /// Takes in one WebSocket message. Errors: kMalformed, kUnsupported, kCapacity (a queue is full); it is
  /// then dropped and counted.
  Result<void> receive(std::span<const std::byte> bytes);
  /// The oldest message to be sent, or nothing.
  [[nodiscard]] std::optional<Bytes> next_message();
  /// Last one of this connection.
  [[nodiscard]] const std::optional<ServerStatusMessage>& server_status() const { return server_status_; }

  [[nodiscard]] ParticipantId self() const override { return {}; }
  void take_sessions(std::vector<Received<SessionMessage>>& out) override;
  void pass_over_session(PassOver /*until*/) override {}  // a gateway has one
  [[nodiscard]] bool server_alive() override { return server_alive_; }
  /// A gateway that announces the epoch that is played may go on over another connection.
  [[nodiscard]] bool hears_all_servers() const override { return !anew_; }
  [[nodiscard]] bool collects() const override { return true; }
  Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                           ClientId client) override;
  void close_stream(std::uint32_t stream) override;
  void close_streams() override;
  Result<void> open_snapshots(std::uint32_t stream) override;
  void close_snapshots(std::uint32_t stream) override;
  void take(std::vector<Received<DeltaMessage>>& out) override;
  void take(std::vector<Received<ScheduledInputMessage>>& out) override;
  void take(std::vector<Received<SnapshotMessage>>& out) override;
  void take(std::vector<Received<ReplyMessage>>& out) override;
  void take(std::vector<Received<ServerStatusMessage>>& out) override;
  Result<void> write(const AckMessage& message) override;
  Result<void> write(const InputMessage& message) override;
  Result<void> write(const ClientStatusMessage& message) override;
  [[nodiscard]] std::uint64_t dropped() const override { return dropped_; }
  [[nodiscard]] std::uint64_t wire_bytes(std::int64_t /*now_ns*/) const override { return wire_bytes_; }
  void wait(std::chrono::nanoseconds /*timeout*/) override {}

 private:
  template <class M>
  struct Queue {
    std::vector<Received<M>> messages;
    std::size_t bytes = 0;
    bool open = false;  ///< what comes for one that is not is of no interest
    void close() { *this = {}; }
    void clear() {
      messages.clear();
      bytes = 0;
    }
  };

  template <class M>
  Queue<M>& queue() {
    return std::get<Queue<M>>(queues_);
  }
  template <class M>
  Result<void> accept(M&& message, std::size_t size);
  template <class M>
  Result<void> put(Queue<M>& queue, M message, std::size_t size);
  template <class M>
  void take_all(std::vector<Received<M>>& out);
  template <class M>
  Result<void> send(const M& message);

  bool connected_ = false, anew_ = false;
  bool told_ = false;  // the client took what this connection announced
  bool server_alive_ = false;
  ParticipantId gateway_;  ///< another for each connection
  std::uint64_t connections_ = 0;
  std::uint64_t wire_bytes_ = 0;
  void set_limits();

  Epoch epoch_ = 0;                          ///< of what is open
  std::map<std::uint32_t, Limits> streams_;  ///< that are open, by id
  Limits limits_;
  std::optional<SessionMessage> session_;  ///< not yet taken
  std::optional<ServerStatusMessage> server_status_;
  bool status_is_new_ = false;  ///< not yet taken
  std::tuple<Queue<DeltaMessage>, Queue<ScheduledInputMessage>, Queue<SnapshotMessage>, Queue<ReplyMessage>>
      queues_;
  std::deque<Bytes> out_;
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::transport
