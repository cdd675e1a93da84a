#pragma once
// Hands what a client takes in to the writer of an audience's files.

#include <cstddef>
#include <utility>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "services/follow/audience/writer.hpp"

namespace tandem::audience {

/// A listener of a client that plays. Give its client's calls of this class to it, and call turned() after
/// each poll. Not thread-safe.
class Capture final : public client::CoreListener {
 public:
  /// `writer` must outlive it.
  explicit Capture(Writer& writer) : writer_(&writer) {}
  /// Call it once, before the first event. `core` must outlive it.
  void watch(const client::ClientCore& core) { core_ = &core; }

  void on_names(const transport::SessionMessage& /*session*/) override {
    if (core_->stream() != nullptr) announce(*core_->stream());
  }
  void on_stream(const transport::StreamMessage& stream) override {
    announce(stream);
    if (core_->timeline() != nullptr) cut_snapshot();
  }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    writer_->add_snapshot(snapshot.frame, snapshot.bytes);
  }
  void on_scheduled(const transport::ScheduledInputMessage& input) override { writer_->add(input); }
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override {
    writer_->add(epoch, delta, steady_ns_);
    if (writer_->wants_snapshot()) cut_snapshot();
  }
  /// Call before and after each poll of the client.
  void turned(client::Now now) {
    steady_ns_ = now.steady_ns;
    writer_->turned(now.steady_ns);
  }

 private:
  void announce(const transport::StreamMessage& stream) {
    transport::SessionMessage session = *core_->session();
    session.streams = {stream};
    writer_->add(session);
  }
  void cut_snapshot() {
    core_->timeline()->snapshot(snapshot_);
    writer_->add_snapshot(core_->timeline()->applied(), snapshot_);
  }

  Writer* writer_;
  const client::ClientCore* core_ = nullptr;
  std::int64_t steady_ns_ = 0;
  transport::Bytes snapshot_;
};

}  // namespace tandem::audience
