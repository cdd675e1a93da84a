#pragma once
// A session that is followed, into a recording.

#include <cstdint>

#include "services/follow/following/session_sink.hpp"
#include "services/follow/following/world.hpp"
#include "services/follow/recording/recorder.hpp"

namespace tandem::recording {

/// The clocks of the machine that records.
struct Clocks {
  std::int64_t (*steady_ns)();
  std::int64_t (*wall_ns)();
  [[nodiscard]] client::Now now() const { return {steady_ns(), wall_ns()}; }
};

/// Every message gets the time of its call, and a change of the stream begins with a snapshot of its state.
/// Not thread-safe.
class RecordingSink final : public following::SessionSink {
 public:
  /// Both must outlive it. `world`: whose events it is told.
  RecordingSink(Recorder& recorder, following::FollowedWorld& world, const Clocks& clocks)
      : recorder_(&recorder), world_(&world), clocks_(clocks) {}

  void on_session(const transport::SessionMessage& session) override {
    epoch_ = session.epoch;
    recorder_->add(session, clocks_.now());
    cut(clocks_.now());
  }
  void on_names(const transport::SessionMessage& session) override { recorder_->add(session, clocks_.now()); }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    recorder_->add(snapshot, clocks_.now());
  }
  void on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t /*now_ns*/) override {
    recorder_->add(input, clocks_.now());
  }
  void on_applied(const client::CompleteDelta& delta, std::int64_t /*now_ns*/) override {
    recorder_->add(epoch_, delta, clocks_.now());
  }
  void on_polled(client::Now now) override {
    if (recorder_->snapshot_due(now.steady_ns)) cut(now);
  }

 private:
  void cut(client::Now now) {
    if (auto cut = world_->cut()) recorder_->cut_snapshot(cut->frame, std::move(cut->bytes), now);
  }

  Recorder* recorder_;
  following::FollowedWorld* world_;
  Clocks clocks_;
  Epoch epoch_ = 0;
};

}  // namespace tandem::recording
