#pragma once
// Decides which server owns a session name.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "sdk/wire/port.hpp"
#include "services/host/clients/notices.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

/// Looks for other servers of the same session. Before this server announces, any live server keeps the
/// session. Afterwards the server with more followers keeps it, even if it started later. A follower is a DDS
/// participant whose clients acknowledge the server's epoch. So a server that was away while another took
/// over does not end the other, and an announcement without followers ends nobody. A server that stands by
/// has no claim, and neither has who announces this server's own epoch, where anybody may announce.
class Claim {
 public:
  /// Two servers that started at the same time may both have announced by then: one of them leaves, even if
  /// it has followers.
  static constexpr std::int64_t kSettledNs = 2'000'000'000;
  /// How long an acknowledgement counts; an observer sends one every ten seconds. With less, observers would
  /// count only now and then, and neither of two servers would be behind for kBehindNs.
  static constexpr std::int64_t kFollowedNs = 25'000'000'000;
  /// A server that has had fewer followers than another for so long leaves. The delay is needed because
  /// followers of both are discovered one by one.
  static constexpr std::int64_t kBehindNs = 1'000'000'000;
  /// Epochs that are closer than this do not tell which server was first.
  static constexpr std::int64_t kOlderMs = 2000;

  /// The time that a server which starts afresh gives one that stands by. That one learns only with a lease
  /// that its live server was killed, and then takes over.
  static constexpr std::int64_t kStandbyNs = 5'000'000'000;
  /// The time for a server to leave after it has handed over.
  static constexpr std::int64_t kIgnoredNs = 5'000'000'000;

  Claim(Epoch epoch, const transport::ParticipantId& self) : epoch_(epoch), self_(self) {}

  void announced(std::int64_t now_ns) { announced_ns_ = now_ns; }
  /// This server takes over that epoch from that server, which has no claim before this one has announced
  /// itself for kIgnoredNs. Others that announce the epoch imitate it.
  void takes_over(Epoch epoch, const transport::ParticipantId& server) {
    taken_over_ = epoch;
    ignored_ = server;
  }
  /// Tells which participants may continue this server's epoch: they stood by for it.
  void set_may_succeed(std::function<bool(const transport::ParticipantId&)> may_succeed) {
    may_succeed_ = std::move(may_succeed);
  }
  /// True if, at the last check(), there was another live server that this one does not give way to.
  [[nodiscard]] bool has_rival() const { return has_rival_; }
  /// True if, at the last check(), a live server that may do so continued this server's epoch.
  [[nodiscard]] bool is_continued() const { return is_continued_; }
  /// How much longer a server that starts afresh must claim, as of the last check(): kStandbyNs if a server
  /// stands by, as that one holds the session's world.
  [[nodiscard]] std::int64_t gives_ns() const { return has_standby_ ? kStandbyNs : 0; }
  /// Notes an acknowledgement, whatever its content.
  void acknowledged(Epoch epoch, const transport::ParticipantId& from, std::int64_t now_ns);
  /// Returns kConflict, naming the other server, if this server has to give way. A server that this one does
  /// not give way to is noted once.
  [[nodiscard]] std::optional<Error> check(transport::ServerPort& port, Notices& notices,
                                           std::int64_t now_ns);

 private:
  using Other = transport::Received<transport::SessionMessage>;
  struct Acknowledgement {
    Epoch epoch = 0;
    std::int64_t at_ns = 0;
  };
  [[nodiscard]] bool continues_ours(const Other& other) const;
  [[nodiscard]] bool gives_way(const Other& other, std::int64_t now_ns);
  [[nodiscard]] bool comes_first(const Other& other) const;
  /// True for a participant that announces an epoch which another one owns. While this server is not settled,
  /// either of two that started at once may own it.
  [[nodiscard]] bool imitates(const Other& other, std::int64_t now_ns) const;
  [[nodiscard]] std::ptrdiff_t followers(Epoch epoch) const;
  void note(const Other& other, bool imitates, Notices& notices, std::int64_t now_ns);

  Epoch epoch_;
  transport::ParticipantId self_;
  std::optional<std::int64_t> announced_ns_;
  std::optional<Epoch> taken_over_;
  std::optional<transport::ParticipantId> ignored_;
  std::function<bool(const transport::ParticipantId&)> may_succeed_;
  bool is_continued_ = false, has_rival_ = false, has_standby_ = false;
  std::map<transport::ParticipantId, Acknowledgement> newest_;  // of each participant, not older than
                                                                // kFollowedNs
  std::map<transport::ParticipantId, std::int64_t> behind_since_;
  std::vector<transport::ParticipantId> noted_;
  std::vector<Other> others_;
};

}  // namespace tandem::host
