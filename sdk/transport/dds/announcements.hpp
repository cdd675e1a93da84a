#pragma once
// Tracks the servers and which of them are alive.

#include <algorithm>
#include <atomic>
#include <optional>
#include <string>
#include <utility>

#include "sdk/transport/dds/node.hpp"
#include "sdk/wire/session_book.hpp"

namespace tandem::transport::dds {

/// Reads TandemSession and, as a sign of life, TandemServerStatus.
///
/// Cyclone DDS declares all writers of a silent participant dead. It declares each of them alive again only
/// with that writer's next sample. A session is announced once, so a server counts as alive as long as any of
/// its writers is. Where a topic is read that shows life, that one alone counts: it tells soonest.
/// A server that was shown dead is alive again with its next sample of any topic, and not because one of its
/// longer leases still runs. (Cyclone DDS takes a writer for alive again only with a sample, not when it
/// shows life.)
class Announcements {
 public:
  /// `options.watched`: the waiting caller calls refresh() each time. `status_partition`: empty, or where
  /// TandemServerStatus is read instead.
  static Result<Announcements> create(Node& node, const ReaderOptions& options = {},
                                      const std::string& status_partition = {}) {
    auto sessions = node.reader<SessionMessage>("sessions", options);
    if (!sessions) return tl::unexpected(sessions.error());
    ReaderOptions of_status = options;
    if (!status_partition.empty()) of_status.partitions = {status_partition};
    auto status = node.reader<ServerStatusMessage>("server status", of_status);
    if (!status) return tl::unexpected(status.error());
    return Announcements(std::move(*sessions), std::move(*status));
  }

  /// Takes what came. `name`: the session's name, empty for all sessions; other sessions are counted in
  /// `dropped`. `shows_life(participant)` says whether a topic that shows life does so for that server
  /// (std::optional<bool>): that decides. It is empty where none is read; then any writer will do.
  template <class ShowsLife>
  void refresh(const std::string& name, std::atomic<std::uint64_t>& dropped, ShowsLife&& shows_life) {
    sessions_.take(dropped, [&](dds_instance_handle_t writer, Received<SessionMessage>&& received) {
      heard(received.from);
      if (name.empty() || received.message.session == name) {
        book_.put(writer, std::move(received));
      } else {
        ++dropped;
      }
    });
    status_.take(dropped, [&](dds_instance_handle_t, Stamped<ServerStatusMessage>&& status) {
      heard(status.from);
      statuses_.push_back(std::move(status));
    });
    if (statuses_.size() > kMaxStatuses) statuses_.erase(statuses_.begin(), statuses_.end() - kMaxStatuses);
    book_.update([&](dds_instance_handle_t writer, const ParticipantId& participant) {
      const WriterState state = sessions_.state(writer);
      if (state == WriterState::kGone) return state;
      const bool lives = state == WriterState::kLive || status_.alive(participant);
      return judged(participant, shows_life(participant), lives) ? WriterState::kLive : WriterState::kSilent;
    });
  }

  [[nodiscard]] SessionBook& book() { return book_; }
  /// The reader of TandemSession.
  [[nodiscard]] dds_entity_t sessions() const { return sessions_.get(); }
  /// The newest status samples that the caller has not taken yet.
  [[nodiscard]] std::vector<Stamped<ServerStatusMessage>>& statuses() { return statuses_; }

 private:
  static constexpr std::ptrdiff_t kMaxStatuses = 256;
  static constexpr std::size_t kMaxDeaths = 64;

  /// A server whose death was shown.
  struct Death {
    ParticipantId server;
    bool is_heard = false;  // a sample came from it since
  };
  void heard(const ParticipantId& server) {
    for (Death& death : deaths_) death.is_heard = death.is_heard || death.server == server;
  }
  /// `shows`: as shows_life() says; `lives`: as automatic liveliness says.
  bool judged(const ParticipantId& server, std::optional<bool> shows, bool lives) {
    auto death = std::ranges::find(deaths_, server, &Death::server);
    if (shows && *shows) {
      if (death != deaths_.end()) deaths_.erase(death);
      return true;
    }
    if (death != deaths_.end()) return death->is_heard && lives;
    if (!shows) return lives;
    if (deaths_.size() >= kMaxDeaths) deaths_.erase(deaths_.begin());
    deaths_.push_back({server});
    return false;
  }

  Announcements(Reader<SessionMessage> sessions, Reader<ServerStatusMessage> status)
      : sessions_(std::move(sessions)), status_(std::move(status)) {}

  Reader<SessionMessage> sessions_;
  Reader<ServerStatusMessage> status_;
  std::vector<Stamped<ServerStatusMessage>> statuses_;
  std::vector<Death> deaths_;  // in the order in which they were noticed
  SessionBook book_;
};

}  // namespace tandem::transport::dds
