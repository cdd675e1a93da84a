#pragma once
// A participant, an observer, or an application that draws: the SDK's core over the simulated network.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "services/follow/following/session_client.hpp"
#include "tests/fault/world/actors/actor.hpp"
#include "tests/fault/world/actors/server.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::world {

/// Compares what a client takes in with the truth. Used by everybody who has a ClientCore.
class Witness : public client::CoreListener {
 public:
  /// What a viewer of a gateway is told of its inputs is less: gravities share an outcome, and nothing is
  /// known of what a server took back.
  enum class Of : std::uint8_t { kClient, kViewer };
  Witness(Stage& stage, std::string who, Of of = Of::kClient)
      : stage_(stage), who_(std::move(who)), of_(of) {}
  void watch(const client::ClientCore& core) { core_ = &core; }

  void on_session(const transport::SessionMessage& session) override;
  void on_stream(const transport::StreamMessage& stream) override;
  void on_snapshot(const transport::SnapshotMessage& snapshot) override;
  void on_scheduled(const transport::ScheduledInputMessage& input) override;
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override;
  void on_outcome(const client::InputOutcome& outcome) override;
  void on_resync(client::ResyncReason reason) override;

  /// An input was sent, with the value that makes it unique; `never`: nobody may take it.
  void sent(std::uint64_t number, double value, bool never, bool shares = false);
  /// Blames what is still wrong about inputs at the end of the world.
  void check_end();

 private:
  struct Sent {
    double value = 0;
    bool never = false, shares = false;
    std::int64_t at_ns = 0;
    Epoch epoch = 0;
    /// This and all later epochs went on from one another, as far as this client saw.
    bool unbroken = true;
    std::optional<client::InputOutcome> told;
    int times = 0, lost = 0;
  };
  void blame(const char* invariant, std::string what) const {
    stage_.blame(invariant, who_, std::move(what));
  }
  void compare(std::uint32_t stream, Frame frame, std::uint64_t hash);

  Stage& stage_;
  std::string who_;
  Of of_;
  const client::ClientCore* core_ = nullptr;
  std::uint32_t stream_ = 0;
  Epoch epoch_ = 0;
  Frame next_ = 0;  ///< 0: after a snapshot only
  std::map<std::uint64_t, Sent> sent_;
};

/// A witness of who follows for sinks.
class WitnessSink : public following::SessionSink {
 public:
  WitnessSink(Stage& stage, std::string who) : witness_(stage, std::move(who)) {}
  void watch(const following::SessionClient& client) { witness_.watch(client.core()); }

  void on_session(const transport::SessionMessage& session) override {
    epoch_ = session.epoch;
    witness_.on_session(session);
    witness_.on_stream(session.streams.front());
  }
  void on_resync(client::ResyncReason reason) override { witness_.on_resync(reason); }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override { witness_.on_snapshot(snapshot); }
  void on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t /*now_ns*/) override {
    witness_.on_scheduled(input);
  }
  void on_applied(const client::CompleteDelta& delta, std::int64_t /*now_ns*/) override {
    witness_.on_applied(epoch_, delta);
  }

 private:
  Witness witness_;
  Epoch epoch_ = 0;
};

class Client final : public Actor {
 public:
  Client(Stage& stage, std::string name, ClientSettings settings, const Service& server,
         std::uint64_t first_id);
  ~Client() override;

  void burst(std::uint32_t inputs) override;
  void repeat() override;
  void prefer(std::uint64_t salt) override;
  [[nodiscard]] std::vector<transport::ParticipantId> participants() const override;
  void check() override;
  void check_end() override;

 protected:
  void on_start() override;
  void on_crash(bool power_fails) override;
  void on_leave() override;
  void on_poll() override;
  [[nodiscard]] std::int64_t due_ns() const override { return due_ns_; }

 private:
  void send_input();
  void draw();
  void drop();

  ClientSettings settings_;
  const Service& server_;
  Dice dice_;
  std::uint64_t next_id_;
  std::unique_ptr<transport::ClientPort> port_;
  std::unique_ptr<Witness> witness_;
  std::unique_ptr<client::ClientCore> core_;
  std::int64_t due_ns_ = 0;
  std::int64_t next_input_ns_ = 0, next_draw_ns_ = 0;
  std::optional<transport::InputMessage> last_input_;
  ClientPhase told_phase_ = ClientPhase::kSearching;
  Sample sample_;
};

}  // namespace tandem::world
