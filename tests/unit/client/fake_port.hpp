#pragma once
// A client port whose other side is the test.

#include <utility>
#include <vector>

#include "sdk/transport/port.hpp"

namespace tandem::client {

class FakePort : public transport::ClientPort {
 public:
  [[nodiscard]] transport::ParticipantId self() const override { return {}; }
  void take_sessions(std::vector<transport::Received<transport::SessionMessage>>& out) override {
    move(sessions, out);
  }
  void pass_over_session(transport::PassOver until) override { passed_over.push_back(until); }
  [[nodiscard]] bool server_alive() override { return alive; }
  Result<void> open_stream(const transport::SessionMessage& session,
                           const transport::StreamMessage& /*stream*/,
                           transport::ClientId /*client*/) override {
    opened_epochs.push_back(session.epoch);
    stream_open = true;
    return {};
  }
  void close_stream() override {
    close_snapshots();
    stream_open = false;
  }
  Result<void> open_snapshots() override {
    snapshots_open = true;
    return {};
  }
  void close_snapshots() override {
    snapshots_open = false;
    snapshots.clear();
  }
  void take(std::vector<transport::Received<transport::DeltaMessage>>& out) override { move(deltas, out); }
  void take(std::vector<transport::Received<transport::ScheduledInputMessage>>& out) override {
    move(inputs, out);
  }
  void take(std::vector<transport::Received<transport::SnapshotMessage>>& out) override {
    if (snapshots_open) move(snapshots, out);
  }
  void take(std::vector<transport::Received<transport::ReplyMessage>>& out) override { move(replies, out); }
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

  bool alive = true;
  bool stream_open = false, snapshots_open = false;
  std::vector<transport::PassOver> passed_over;
  std::vector<Epoch> opened_epochs;
  std::vector<transport::Received<transport::SessionMessage>> sessions;
  std::vector<transport::Received<transport::DeltaMessage>> deltas;
  std::vector<transport::Received<transport::ScheduledInputMessage>> inputs;
  std::vector<transport::Received<transport::SnapshotMessage>> snapshots;
  std::vector<transport::Received<transport::ReplyMessage>> replies;
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
