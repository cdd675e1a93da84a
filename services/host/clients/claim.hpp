#pragma once
// Who owns a session name.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "sdk/transport/port.hpp"
#include "services/host/clients/notices.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

/// Looks for other servers of the same session. Before announcing, any live one wins. Afterwards the one with
/// more followers does: DDS participants whose clients acknowledge its epoch. So neither a server that was
/// away while another took over ends that one, nor an announcement that nobody follows anybody.
class Claim {
 public:
  /// Two that started at once may both have announced by now: one of them leaves, followed or not.
  static constexpr std::int64_t kSettledNs = 2'000'000'000;
  /// An acknowledgement counts for so long; each client repeats it four times a second.
  static constexpr std::int64_t kFollowedNs = 1'000'000'000;
  /// Behind another for so long: time to leave. Followers of both are discovered one by one.
  static constexpr std::int64_t kBehindNs = 1'000'000'000;
  /// Epochs closer than this tell nothing about who was first.
  static constexpr std::int64_t kOlderMs = 2000;

  Claim(Epoch epoch, const transport::ParticipantId& self) : epoch_(epoch), self_(self) {}

  void announced(std::int64_t now_ns) { announced_ns_ = now_ns; }
  /// Any acknowledgement that came, whatever it says.
  void acknowledged(Epoch epoch, const transport::ParticipantId& from, std::int64_t now_ns);
  /// kConflict, naming the other server, when this one has to give way. To whom it does not give way it notes
  /// once.
  [[nodiscard]] std::optional<Error> check(transport::ServerPort& port, Notices& notices,
                                           std::int64_t now_ns);

 private:
  using Other = transport::Received<transport::SessionMessage>;
  struct Acknowledgement {
    Epoch epoch = 0;
    std::int64_t at_ns = 0;
  };
  [[nodiscard]] bool gives_way(const Other& other, std::int64_t now_ns);
  [[nodiscard]] bool comes_first(const Other& other) const;
  [[nodiscard]] std::ptrdiff_t followers(Epoch epoch) const;
  void note(const Other& other, Notices& notices, std::int64_t now_ns);

  Epoch epoch_;
  transport::ParticipantId self_;
  std::optional<std::int64_t> announced_ns_;
  std::map<transport::ParticipantId, Acknowledgement> newest_;  // of each, not older than kFollowedNs
  std::map<transport::ParticipantId, std::int64_t> behind_since_;
  std::vector<transport::ParticipantId> noted_;
  std::vector<Other> others_;
};

}  // namespace tandem::host
