#pragma once
// A client port with the test on its other side.

#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "sdk/wire/port.hpp"

namespace tandem::client {

class FakePort : public transport::ClientPort {
 public:
  [[nodiscard]] transport::ParticipantId self() const override { return {}; }
  void take_sessions(std::vector<transport::Received<transport::SessionMessage>>& out) override {
    move(sessions, out);
  }
  void pass_over_session(transport::PassOver until) override {
    if (until == transport::PassOver::kForItsSuccessor) {
      successor_wanted = true;
    } else {
      passed_over.push_back(until);
    }
  }
  [[nodiscard]] bool server_alive() override { return alive; }
  [[nodiscard]] std::optional<transport::ClientId> take_renewal() override {
    return std::exchange(renewal, std::nullopt);
  }
  [[nodiscard]] bool hears_all_servers() const override { return hears_all; }
  [[nodiscard]] bool collects() const override { return collects_frames; }
  Result<void> open_stream(const transport::SessionMessage& session, const transport::StreamMessage& stream,
                           transport::ClientId /*client*/) override {
    opened_epochs.push_back(session.epoch);
    streams_open.insert(stream.id.id);
    return {};
  }
  void close_stream(std::uint32_t stream) override {
    close_snapshots(stream);
    streams_open.erase(stream);
  }
  void close_streams() override {
    streams_open.clear();
    snapshots_open.clear();
    snapshots.clear();
  }
  Result<void> open_snapshots(std::uint32_t stream) override {
    snapshots_open.insert(stream);
    return {};
  }
  void close_snapshots(std::uint32_t stream) override {
    snapshots_open.erase(stream);
    if (snapshots_open.empty()) snapshots.clear();
  }
  void take(std::vector<transport::Received<transport::DeltaMessage>>& out) override { move(deltas, out); }
  void take(std::vector<transport::Received<transport::ScheduledInputMessage>>& out) override {
    move(inputs, out);
  }
  void take(std::vector<transport::Received<transport::SnapshotMessage>>& out) override {
    if (!snapshots_open.empty()) move(snapshots, out);
  }
  void take(std::vector<transport::Received<transport::ReplyMessage>>& out) override { move(replies, out); }
  void take(std::vector<transport::Received<transport::ServerStatusMessage>>& out) override {
    move(server_statuses, out);
  }
  Result<void> write(const transport::AckMessage& message) override {
    acks.push_back(message);
    return {};
  }
  Result<void> write(const transport::InputMessage& message) override {
    sent_inputs.push_back(message);
    return {};
  }
  Result<void> write(const transport::ClientStatusMessage& message) override {
    statuses.push_back(message);
    return {};
  }
  [[nodiscard]] std::uint64_t dropped() const override { return 0; }
  void wait(std::chrono::nanoseconds /*timeout*/) override {}

  bool alive = true, hears_all = false, collects_frames = false;
  std::optional<transport::ClientId> renewal;
  std::set<std::uint32_t> streams_open, snapshots_open;  ///< ids
  std::vector<transport::PassOver> passed_over;
  bool successor_wanted = false;  ///< kForItsSuccessor was asked for
  std::vector<Epoch> opened_epochs;
  std::vector<transport::Received<transport::SessionMessage>> sessions;
  std::vector<transport::Received<transport::DeltaMessage>> deltas;
  std::vector<transport::Received<transport::ScheduledInputMessage>> inputs;
  std::vector<transport::Received<transport::SnapshotMessage>> snapshots;
  std::vector<transport::Received<transport::ReplyMessage>> replies;
  std::vector<transport::Received<transport::ServerStatusMessage>> server_statuses;
  std::vector<transport::AckMessage> acks;
  std::vector<transport::InputMessage> sent_inputs;
  std::vector<transport::ClientStatusMessage> statuses;

 private:
  template <class M>
  static void move(std::vector<M>& from, std::vector<M>& to) {
    for (auto& sample : from) to.push_back(std::move(sample));
    from.clear();
  }
};

}  // namespace tandem::client
