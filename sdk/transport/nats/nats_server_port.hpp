#pragma once
// Publishes a session on NATS.

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/nats/followers.hpp"
#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/nats_client_port.hpp"
#include "sdk/transport/nats/nats_wire.hpp"
#include "sdk/transport/nats/sent_log.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::transport {

/// The rules of idl/RELAY.md for whoever publishes: every delta goes out once for all, and again only to who
/// asks for it. Requests are bounded by process, by site and in total. No server can stand by over NATS.
/// Threads as in ServerPort. Sans-I/O but for the bus and the clock.
class NatsServerPort final : public ServerPort {
 public:
  static constexpr std::int64_t kBeatNs = kSecond / 4;
  /// Sites whose Hello it goes by, each a subscription: together with its others fewer than the NATS server
  /// allows (deploy/nats/limits.conf). One that says none for kSiteSilentNs is not listened to any more.
  static constexpr std::size_t kMaxSites = 512;
  static constexpr std::int64_t kSiteSilentNs = 10 * kSecond;
  /// Sites that are told their proof, a second.
  static constexpr double kProofsPerSecond = 200;
  /// Bytes a second that all together are sent on request, and at once.
  static constexpr double kAllBytes = 40e6, kAllBurst = 80e6;

  NatsServerPort(NatsPortOptions options, std::unique_ptr<NatsBus> bus);
  ~NatsServerPort() override;
  NatsServerPort(const NatsServerPort&) = delete;
  NatsServerPort& operator=(const NatsServerPort&) = delete;

  [[nodiscard]] ParticipantId self() const override;
  void take_sessions(std::vector<Received<SessionMessage>>& out) override;
  [[nodiscard]] bool vouches_for_servers() const override { return true; }
  Result<void> open_streams(std::uint32_t count) override;
  Result<void> write(const SessionMessage& message) override;
  Result<void> write(const DeltaMessage& message) override;
  Result<void> write(const ScheduledInputMessage& message) override;
  Result<void> write(ClientId to, const SnapshotMessage& message) override;
  Result<void> write(const ReplyMessage& message) override;
  Result<void> write(const ServerStatusMessage& message) override;
  Result<void> open_client(ClientId client) override;
  void close_client(ClientId client) override;
  void take(std::vector<Received<InputMessage>>& out) override;
  void take(std::vector<Received<AckMessage>>& out) override;
  [[nodiscard]] bool joined(const ParticipantId& participant, ClientId client, std::uint32_t stream) override;
  [[nodiscard]] bool alive(const ParticipantId& participant) override;
  [[nodiscard]] bool ended(const ParticipantId& participant) override;
  [[nodiscard]] std::uint64_t dropped() const override;
  /// May be called by a thread of its own, which only waits.
  void wait(std::chrono::nanoseconds timeout) override { bus_->wait(timeout); }
  void wake() override { bus_->wake(); }

  void take(std::vector<Received<StandbyMessage>>& /*out*/) override {}
  void take(std::vector<Received<CommandMessage>>& /*out*/) override {}
  Result<void> open_standby(ClientId /*standby*/) override { return no_standby(); }
  void close_standby(ClientId /*standby*/) override {}
  [[nodiscard]] bool follows(const ParticipantId& /*participant*/, ClientId /*standby*/) override {
    return false;
  }
  Result<void> write(const JournalMessage& /*message*/) override { return no_standby(); }
  Result<void> write(ClientId /*to*/, const CheckpointMessage& /*message*/) override { return no_standby(); }
  Result<void> follow(ClientId /*standby*/) override { return no_standby(); }
  void unfollow() override {}
  void take(std::vector<Received<JournalMessage>>& /*out*/) override {}
  void take(std::vector<Received<CheckpointMessage>>& /*out*/) override {}
  Result<void> write(const StandbyMessage& /*message*/) override { return no_standby(); }

  void take(std::vector<ClientStatusMessage>& out) override;
  [[nodiscard]] std::optional<PublishedCounts> counts() const override;
  [[nodiscard]] bool connected() const { return bus_->connected(); }
  [[nodiscard]] std::uint64_t connections_lost() const override { return bus_->lost(); }
  [[nodiscard]] std::string trouble() const override { return bus_->trouble(); }

 private:
  struct Rival {
    Epoch epoch = 0;
    std::int64_t heard_ns = 0;
  };

  [[nodiscard]] static tl::unexpected<Error> no_standby() {
    return fail(ErrorCode::kUnsupported, "no server stands by over NATS");
  }
  /// One site may be heard by two subscriptions, and each of its messages counts once.
  [[nodiscard]] std::string group() const { return "relay-" + std::to_string(options_.sender); }
  void pump();
  void accept(const NatsArrival& arrival);
  void accept(const nats::Hello& hello);
  void answer(const nats::Ask& ask, const nats::Followers::Heard& asker, const std::string& to);
  void beat(bool leaving);
  void forget_silent();
  [[nodiscard]] Result<void> publish(const std::string& subject, std::span<const std::byte> message,
                                     nats::Packer& packer);
  [[nodiscard]] std::string to(ClientId client) const;
  template <class M>
  Result<void> send(const std::string& subject, const M& message);
  template <class M>
  Result<void> log_and_send(const std::string& subject, nats::SentLog& log, std::uint64_t number,
                            const M& message);

  NatsPortOptions options_;
  std::unique_ptr<NatsBus> bus_;

  // Of the thread that takes.
  nats::Packer answers_, beats_;
  nats::Unpacker unpacker_;
  std::vector<NatsArrival> arrivals_;
  std::int64_t now_ns_ = 0;
  std::int64_t beat_ns_ = INT64_MIN / 2, swept_ns_ = 0;
  std::map<std::uint32_t, Rival> rivals_;
  std::map<std::string, std::int64_t> sites_;  // that are listened to; when they said Hello last
  nats::Allowance proofs_{kProofsPerSecond, kProofsPerSecond};
  nats::Allowance all_bytes_{kAllBytes, kAllBurst};
  std::vector<Received<InputMessage>> inputs_;
  std::vector<Received<AckMessage>> acks_;
  std::vector<ClientStatusMessage> reports_;

  // Of the thread that writes.
  nats::Packer writes_;

  mutable std::mutex mutex_;  // guards what follows
  nats::Followers followers_;
  Epoch epoch_ = 0;
  std::uint64_t announcement_ = 0, announced_ = 0;
  std::shared_ptr<const Bytes> session_;
  std::array<std::optional<nats::SentLog>, kMaxStreams> deltas_;
  std::int64_t period_ns_ = 0;  // of the thread that writes
  std::array<StreamId, kMaxStreams> ids_{};
  nats::SentLog scheduled_;
  PublishedCounts counts_;
};

}  // namespace tandem::transport
