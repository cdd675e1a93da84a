#pragma once
// What a client takes in, as a recording holds it.

#include <cstdint>

#include "sdk/client/client_core.hpp"
#include "services/follow/recording/recorder.hpp"

namespace tandem::recording {

/// The clocks of the machine that records.
struct Clocks {
  std::int64_t (*steady_ns)();
  std::int64_t (*wall_ns)();
  [[nodiscard]] client::Now now() const { return {steady_ns(), wall_ns()}; }
};

/// Hands a client's events to a recorder. A recording holds one stream at a time, and a change of the stream
/// begins with a snapshot of its state. Not thread-safe.
class Capture final : public client::CoreListener {
 public:
  /// `recorder` must outlive it.
  Capture(Recorder& recorder, const Clocks& clocks) : recorder_(&recorder), clocks_(clocks) {}
  /// Call it once, before the first event. `core` must outlive it.
  void watch(const client::ClientCore& core) { core_ = &core; }

  void on_names(const transport::SessionMessage& /*session*/) override {
    if (core_->stream() != nullptr) add_session(*core_->stream());
  }
  void on_stream(const transport::StreamMessage& stream) override {
    add_session(stream);
    if (core_->timeline() != nullptr) recorder_->cut_snapshot(*core_->timeline(), clocks_.now());
  }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    recorder_->add(snapshot, clocks_.now());
  }
  void on_scheduled(const transport::ScheduledInputMessage& input) override {
    recorder_->add(input, clocks_.now());
  }
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override {
    recorder_->add(epoch, delta, clocks_.now());
  }
  /// Call after each poll of the client.
  void turned(client::Now now) {
    if (core_->timeline() != nullptr && recorder_->snapshot_due(now.steady_ns))
      recorder_->cut_snapshot(*core_->timeline(), now);
  }

 private:
  void add_session(const transport::StreamMessage& stream) {
    transport::SessionMessage session = *core_->session();
    session.streams = {stream};
    recorder_->add(session, clocks_.now());
  }

  Recorder* recorder_;
  Clocks clocks_;
  const client::ClientCore* core_ = nullptr;
};

}  // namespace tandem::recording
