#pragma once
// The gateway without its sockets, and browsers at the other ends of its connections.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/websocket/web_port.hpp"
#include "services/follow/following/session_client.hpp"
#include "services/gateway/gateway.hpp"
#include "tests/fault/world/actors/client.hpp"

namespace tandem::world {

/// A TCP connection: whole messages, in order, some time later. A loss delays what comes behind it.
struct Connection {
  struct Message {
    std::int64_t due_ns = 0;
    transport::Bytes bytes;
  };
  /// What TCP holds for one that takes nothing.
  static constexpr std::size_t kMaxFlying = std::size_t{64} << 10U;

  gateway::ViewerId viewer = 0;
  std::deque<Message> up, down;
  std::size_t down_bytes = 0;
  bool open = true;
};

class GatewayActor final : public Actor {
 public:
  GatewayActor(Stage& stage, std::string name, const Service& server, std::uint64_t first_id);
  ~GatewayActor() override;

  /// A browser connects; null: it is turned away, or nobody listens.
  [[nodiscard]] std::shared_ptr<Connection> connect();
  /// When a message that is sent now arrives at the other end.
  [[nodiscard]] std::int64_t arrival_of(const std::deque<Connection::Message>& before);
  [[nodiscard]] std::int64_t plays_for_ns() const;
  [[nodiscard]] Frame frame() const { return gateway_ ? gateway_->frame() : 0; }
  [[nodiscard]] std::vector<transport::ParticipantId> participants() const override;
  void check() override;

 protected:
  void on_start() override;
  void on_crash(bool power_fails) override;
  void on_leave() override;
  void on_poll() override;
  [[nodiscard]] std::int64_t due_ns() const override { return due_ns_; }
  [[nodiscard]] std::int64_t arrival_ns() const override;

 private:
  void drop();
  void close(gateway::ViewerId viewer, const char* why);
  void send(gateway::ViewerId viewer);

  const Service& server_;
  Dice dice_;
  std::uint64_t next_id_;
  std::unique_ptr<transport::ClientPort> port_;
  std::unique_ptr<following::SessionClient> client_;
  std::unique_ptr<gateway::Gateway> gateway_;
  std::map<gateway::ViewerId, std::shared_ptr<Connection>> connections_;
  std::vector<gateway::ViewerId> ready_;
  std::int64_t due_ns_ = 0;
  std::int64_t plays_since_ns_ = INT64_MAX;
  std::uint32_t stream_ = 0;  // that it plays since then
};

/// A browser: the client of the WebAssembly module over a connection.
class Browser final : public Actor {
 public:
  Browser(Stage& stage, std::string name, ClientSettings settings, GatewayActor& gateway,
          std::uint64_t first_id);
  ~Browser() override;

  void burst(std::uint32_t inputs) override;
  [[nodiscard]] std::vector<transport::ParticipantId> participants() const override { return {}; }
  void check() override;

 protected:
  void on_start() override;
  void on_crash(bool power_fails) override;
  void on_leave() override;
  void on_poll() override;
  [[nodiscard]] std::int64_t due_ns() const override { return due_ns_; }
  [[nodiscard]] std::int64_t arrival_ns() const override;

 private:
  void drop();
  void send_input();

  ClientSettings settings_;
  GatewayActor& gateway_;
  Dice dice_;
  std::uint64_t next_id_;
  std::shared_ptr<Connection> connection_;
  std::int64_t connect_at_ns_ = 0;
  std::int64_t connected_ns_ = 0;
  std::unique_ptr<transport::WebPort> port_;
  std::unique_ptr<Witness> witness_;
  std::unique_ptr<client::ClientCore> core_;
  std::int64_t due_ns_ = 0, next_input_ns_ = 0;
  ClientPhase told_phase_ = ClientPhase::kSearching;
};

}  // namespace tandem::world
