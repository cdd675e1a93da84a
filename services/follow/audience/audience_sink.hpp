#pragma once
// A session that is followed, into the files of an audience.

#include "services/follow/audience/publication.hpp"
#include "services/follow/following/session_sink.hpp"
#include "services/follow/following/world.hpp"

namespace tandem::audience {

/// Not thread-safe.
class AudienceSink final : public following::SessionSink {
 public:
  /// Both must outlive it. `world`: whose events it is told.
  AudienceSink(Publication& publication, following::FollowedWorld& world)
      : publication_(&publication), writer_(&publication.writer()), world_(&world) {}

  void on_session(const transport::SessionMessage& session) override {
    epoch_ = session.epoch;
    writer_->add(session);
    cut();
  }
  void on_names(const transport::SessionMessage& session) override { writer_->add(session); }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    writer_->add_snapshot(snapshot.frame, snapshot.bytes);
  }
  void on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t /*now_ns*/) override {
    writer_->add(input);
  }
  void on_applied(const client::CompleteDelta& delta, std::int64_t now_ns) override {
    writer_->add(epoch_, delta, now_ns);
    if (writer_->wants_snapshot()) cut();
  }
  void on_polled(client::Now now) override { publication_->turned(now); }

 private:
  void cut() {
    if (const auto cut = world_->cut()) writer_->add_snapshot(cut->frame, cut->bytes);
  }

  Publication* publication_;
  Writer* writer_;
  following::FollowedWorld* world_;
  Epoch epoch_ = 0;
};

}  // namespace tandem::audience
