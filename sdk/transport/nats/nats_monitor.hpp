#pragma once
// Watches the sessions that relays publish on NATS.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/nats_client_port.hpp"
#include "sdk/transport/nats/nats_wire.hpp"
#include "sdk/wire/monitor.hpp"

namespace tandem::transport {

/// Hears beats, status and clients of all sessions (idl/RELAY.md), and asks relays for what they announce. It
/// plays none. Bounded. Sans-I/O but for the bus and the clocks. All calls from one thread.
class NatsMonitor final : public Monitor {
 public:
  static constexpr std::size_t kMaxSessions = 256, kMaxRelays = 16;

  /// The state of a session, as far as it was heard.
  struct Heard {
    struct Relay {
      Epoch epoch = 0;
      std::int64_t heard_ns = 0;
    };
    std::map<std::uint32_t, Relay> relays;  ///< by their sender
    std::uint64_t announcement = 0;         ///< of the last beat
    std::int64_t asked_ns = INT64_MIN / 2;
    std::uint64_t proof = 0;            ///< that a relay told this site; 0: none
    std::optional<std::uint64_t> have;  ///< the announcement of `session`
    SessionMessage session;
  };

  /// Reads site, client, sender and clock of the options; `wall` is the wall clock. `session` is the only one
  /// that is watched; if it is empty, all are that the NATS user may hear.
  NatsMonitor(NatsPortOptions options, std::function<std::int64_t()> wall, const std::string& session,
              std::unique_ptr<NatsBus> bus);

  /// A relay is given as the participant.
  void list_sessions(std::vector<Received<SessionMessage>>& out) override;
  void take(std::vector<Stamped<ServerStatusMessage>>& out) override;
  void take(std::vector<Stamped<ClientStatusMessage>>& out) override;
  /// NATS does not tell.
  [[nodiscard]] std::optional<Peer> describe(const ParticipantId& /*client*/) override {
    return std::nullopt;
  }
  Result<void> write(const CommandMessage& message) override;
  void wait(std::chrono::nanoseconds timeout) override { bus_->wait(timeout); }
  [[nodiscard]] std::string trouble() const override { return bus_->trouble(); }

  /// The sessions as of the last take(). The key is the name as it stands in a subject, with `~` for each
  /// dot.
  [[nodiscard]] const std::map<std::string, Heard>& heard() const { return heard_; }
  /// The version of a relay that speaks another one; 0: none was heard.
  [[nodiscard]] std::uint8_t foreign_version() const { return unpacker_.foreign_version(); }

 private:
  void pump();
  void accept(const NatsArrival& arrival);
  template <class M>
  void keep(M&& message, std::uint32_t sender, std::vector<Stamped<M>>& known);
  void accept_beat(const std::string& session, std::span<const std::byte> message, std::uint32_t sender);
  void accept_proof(const std::string& session, std::span<const std::byte> message);
  void say_hello(const std::string& session, const Heard& heard);
  void ask_for_announcements();
  void publish(const std::string& subject, std::span<const std::byte> message);

  NatsPortOptions options_;
  std::function<std::int64_t()> wall_;
  std::unique_ptr<NatsBus> bus_;
  nats::Packer packer_;
  nats::Unpacker unpacker_;
  std::vector<NatsArrival> arrivals_;
  std::int64_t now_ns_ = 0;
  std::map<std::string, Heard> heard_;
  std::vector<Stamped<ServerStatusMessage>> servers_;
  std::vector<Stamped<ClientStatusMessage>> clients_;
};

}  // namespace tandem::transport
