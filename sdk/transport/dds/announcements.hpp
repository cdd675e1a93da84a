#pragma once
// Tracks the servers and which of them are alive.

#include <atomic>
#include <string>
#include <utility>

#include "sdk/transport/dds/node.hpp"
#include "sdk/wire/session_book.hpp"

namespace tandem::transport::dds {

/// Reads TandemSession and, as a sign of life, TandemServerStatus.
///
/// Cyclone DDS declares all writers of a silent participant dead. It declares each of them alive again only
/// with that writer's next sample. A session is announced once, so a server counts as alive as long as any of
/// its writers is.
class Announcements {
 public:
  /// `options.watched`: the waiting caller calls refresh() each time.
  static Result<Announcements> create(Node& node, const ReaderOptions& options = {}) {
    auto sessions = node.reader<SessionMessage>("sessions", options);
    if (!sessions) return tl::unexpected(sessions.error());
    auto status = node.reader<ServerStatusMessage>("server status", options);
    if (!status) return tl::unexpected(status.error());
    return Announcements(std::move(*sessions), std::move(*status));
  }

  /// Takes what came. `name`: the session's name, empty for all sessions; other sessions are counted in
  /// `dropped`. `alive(participant)` may know further signs of life.
  template <class Alive>
  void refresh(const std::string& name, std::atomic<std::uint64_t>& dropped, Alive&& alive) {
    sessions_.take(dropped, [&](dds_instance_handle_t writer, Received<SessionMessage>&& received) {
      if (name.empty() || received.message.session == name) {
        book_.put(writer, std::move(received));
      } else {
        ++dropped;
      }
    });
    status_.take(dropped, statuses_);
    if (statuses_.size() > kMaxStatuses) statuses_.erase(statuses_.begin(), statuses_.end() - kMaxStatuses);
    book_.update([&](dds_instance_handle_t writer, const ParticipantId& participant) {
      const WriterState state = sessions_.state(writer);
      const bool revived =
          state == WriterState::kSilent && (status_.alive(participant) || alive(participant));
      return revived ? WriterState::kLive : state;
    });
  }

  [[nodiscard]] SessionBook& book() { return book_; }
  /// The newest status samples that the caller has not taken yet.
  [[nodiscard]] std::vector<Stamped<ServerStatusMessage>>& statuses() { return statuses_; }

 private:
  static constexpr std::ptrdiff_t kMaxStatuses = 256;

  Announcements(Reader<SessionMessage> sessions, Reader<ServerStatusMessage> status)
      : sessions_(std::move(sessions)), status_(std::move(status)) {}

  Reader<SessionMessage> sessions_;
  Reader<ServerStatusMessage> status_;
  std::vector<Stamped<ServerStatusMessage>> statuses_;
  SessionBook book_;
};

}  // namespace tandem::transport::dds
