#pragma once
// A client's port that records what a SessionSink does not receive: replies, and what the client writes.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/wire/port.hpp"
#include "services/follow/recording/recording_sink.hpp"

namespace tandem::tool {

/// Hands every call on to another port.
class RecordingPort final : public transport::ClientPort {
 public:
  /// Port and recorder must outlive it.
  RecordingPort(transport::ClientPort& port, recording::Recorder& recorder, const recording::Clocks& clocks)
      : port_(&port), recorder_(&recorder), clocks_(clocks) {}

  [[nodiscard]] transport::ParticipantId self() const override { return port_->self(); }
  void take_sessions(std::vector<transport::Received<transport::SessionMessage>>& out) override {
    port_->take_sessions(out);
  }
  void pass_over_session(transport::PassOver until) override { port_->pass_over_session(until); }
  [[nodiscard]] bool server_alive() override { return port_->server_alive(); }
  [[nodiscard]] bool server_ended() override { return port_->server_ended(); }
  [[nodiscard]] std::string trouble() override { return port_->trouble(); }
  [[nodiscard]] std::optional<transport::ClientId> take_renewal() override { return port_->take_renewal(); }
  [[nodiscard]] bool collects() const override { return port_->collects(); }
  Result<void> open_stream(const transport::SessionMessage& session, const transport::StreamMessage& stream,
                           transport::ClientId client) override {
    return port_->open_stream(session, stream, client);
  }
  void close_stream(std::uint32_t stream) override { port_->close_stream(stream); }
  void close_streams() override { port_->close_streams(); }
  Result<void> open_snapshots(std::uint32_t stream) override { return port_->open_snapshots(stream); }
  void close_snapshots(std::uint32_t stream) override { port_->close_snapshots(stream); }

  void take(std::vector<transport::Received<transport::DeltaMessage>>& out) override { port_->take(out); }
  void take(std::vector<transport::Received<transport::ScheduledInputMessage>>& out) override {
    port_->take(out);
  }
  void take(std::vector<transport::Received<transport::SnapshotMessage>>& out) override { port_->take(out); }
  void take(std::vector<transport::Received<transport::ReplyMessage>>& out) override {
    const std::size_t before = out.size();
    port_->take(out);
    for (std::size_t i = before; i < out.size(); ++i) recorder_->add(out[i].message, clocks_.now());
  }
  void take(std::vector<transport::Received<transport::ServerStatusMessage>>& out) override {
    const std::size_t before = out.size();
    port_->take(out);
    for (std::size_t i = before; i < out.size(); ++i) recorder_->add(out[i].message, clocks_.now());
  }

  Result<void> write(const transport::AckMessage& message) override { return record(message); }
  Result<void> write(const transport::InputMessage& message) override { return record(message); }
  Result<void> write(const transport::ClientStatusMessage& message) override { return record(message); }

  [[nodiscard]] std::uint64_t dropped() const override { return port_->dropped(); }
  [[nodiscard]] std::uint64_t wire_bytes(std::int64_t now_ns) const override {
    return port_->wire_bytes(now_ns);
  }
  void wait(std::chrono::nanoseconds timeout) override { port_->wait(timeout); }
  void wake() override { port_->wake(); }

 private:
  template <class M>
  Result<void> record(const M& message) {
    auto written = port_->write(message);
    if (written) recorder_->add(message, clocks_.now());
    return written;
  }

  transport::ClientPort* port_;
  recording::Recorder* recorder_;
  recording::Clocks clocks_;
};

}  // namespace tandem::tool
