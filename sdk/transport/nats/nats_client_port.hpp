#pragma once
// A client of a session that a relay publishes on NATS.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/nats_wire.hpp"
#include "sdk/transport/nats/repair.hpp"
#include "sdk/transport/nats/site_proof.hpp"
#include "sdk/wire/envelope.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::transport {

struct NatsPortOptions {
  std::string session = "default";
  std::string site = "site";  ///< of this program, as its NATS user may write (idl/RELAY.md)
  ClientId client = 0;        ///< client ports: random, not 0
  std::uint32_t sender = 0;   ///< random: tells this process from others of the site
  /// A clock that never goes back, ns.
  std::function<std::int64_t()> clock;
  /// Client ports: a whole snapshot that this program kept of the stream, when it was started before; empty:
  /// none. The port hands it out for the first one that the client asks for, and asks for the deltas behind
  /// it.
  std::function<std::optional<SnapshotMessage>(Epoch, const StreamId&)> kept = {};
  /// Server ports: bytes of published deltas that are kept for who lost them, all streams together.
  std::size_t log_bytes = 64U << 20U;
  /// Server ports: clients that there are places for.
  std::size_t most_clients = 4096;
  nats::Secret secret = {};  ///< server ports
};

/// The rules of idl/RELAY.md for whoever follows. It puts messages in order and asks for what is missing, so
/// that a client sees what DDS would deliver. Sans-I/O but for the bus and the clock.
class NatsClientPort final : public ClientPort {
 public:
  /// A relay that is silent for so long cannot be heard any more.
  static constexpr std::int64_t kSilentNs = 3 * kSecond / 2;
  /// Time until what could not be played is announced again, and after which it is doubled no more.
  static constexpr std::int64_t kAgainNs = kSecond, kMaxAgainNs = 4 * kSecond;
  /// It says its site's name so often, as relays forget sites that do not.
  static constexpr std::int64_t kHelloNs = 4 * kSecond;

  NatsClientPort(NatsPortOptions options, std::unique_ptr<NatsBus> bus);
  ~NatsClientPort() override;
  NatsClientPort(const NatsClientPort&) = delete;
  NatsClientPort& operator=(const NatsClientPort&) = delete;

  [[nodiscard]] ParticipantId self() const override { return {}; }
  void take_sessions(std::vector<Received<SessionMessage>>& out) override;
  /// There is no other session: what cannot be played is announced again after a while, as strangers may
  /// have forged what could not be played.
  void pass_over_session(PassOver until) override;
  [[nodiscard]] bool server_alive() override;
  [[nodiscard]] std::string trouble() override;
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
  Result<void> write(const InputMessage& message) override { return send(message); }
  Result<void> write(const ClientStatusMessage& message) override { return send(message); }
  [[nodiscard]] std::uint64_t dropped() const override;
  /// May be called by a thread of its own, which only waits.
  void wait(std::chrono::nanoseconds timeout) override { bus_->wait(timeout); }
  void wake() override { bus_->wake(); }

  [[nodiscard]] std::optional<FollowedCounts> counts() const override;
  [[nodiscard]] bool connected() const { return bus_->connected(); }
  [[nodiscard]] std::uint64_t connections_lost() const override { return bus_->lost(); }

 private:
  struct Stream {
    StreamId id;
    Limits limits;
    bool snapshots = false;                      ///< open
    std::optional<SnapshotMessage> kept = {};    ///< that the client did not ask for yet
    std::optional<std::uint32_t> answered = {};  ///< the attempt to join that got it
    nats::DeltaRepair deltas;
    nats::AskTimer timer;
  };

  [[nodiscard]] ParticipantId server() const;
  void pump();
  void accept(const NatsArrival& arrival);
  void accept(const nats::Beat& beat, std::uint32_t sender);
  void accept(GatewayMessage&& message, bool repeated);
  void accept_delta(DeltaMessage&& delta, bool repeated);
  void resume(Stream& stream);
  void say_hello();
  void ask_again();
  void ask_for_missing();
  bool ask(const nats::Ask& ask);
  [[nodiscard]] Stream* find(const StreamId& id);
  [[nodiscard]] Limits widest() const;
  template <class M>
  Result<void> send(const M& message);
  Result<void> publish(const std::string& subject, std::span<const std::byte> message);

  NatsPortOptions options_;
  std::unique_ptr<NatsBus> bus_;
  const std::string from_, to_;
  nats::Packer packer_;
  nats::Unpacker unpacker_;
  std::vector<NatsArrival> arrivals_;
  Bytes envelope_;
  std::int64_t now_ns_ = 0;  // of the last pump()

  // Of the relay that is followed. All of it belongs to the epoch.
  Epoch epoch_ = 0;                       // 0: none was heard
  std::uint32_t again_ = 0;               // how often the epoch was announced again
  std::optional<std::int64_t> again_ns_;  // when it is, the next time
  std::int64_t again_after_ns_ = kAgainNs;
  std::uint32_t relay_ = 0;
  std::int64_t beat_ns_ = INT64_MIN / 2;
  bool left_ = false;
  std::uint64_t proof_ = 0;  // that the relay told the site; 0: none
  std::int64_t hello_ns_ = INT64_MIN / 2;
  std::uint64_t announcement_ = 0;     // of the last beat
  std::optional<std::uint64_t> have_;  // announcement that was taken
  nats::AskTimer session_timer_;
  std::optional<SessionMessage> session_;  // not yet taken

  std::map<std::uint32_t, Stream> streams_;
  nats::InputRepair inputs_repair_;
  nats::AskTimer inputs_timer_;
  nats::Beat::Range inputs_range_;
  std::vector<nats::Beat::OfStream> frames_;  // of the last beat
  std::vector<ScheduledInputMessage> inputs_;
  std::vector<SnapshotMessage> snapshots_;
  std::vector<ReplyMessage> replies_;
  std::vector<ServerStatusMessage> statuses_;
  std::size_t queued_bytes_ = 0;
  FollowedCounts counts_;
};

}  // namespace tandem::transport
