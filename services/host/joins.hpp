#pragma once
// Snapshots on demand.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "sdk/transport/port.hpp"
#include "services/host/roster.hpp"

namespace tandem::host {

/// Decides when a snapshot is made.
class JoinDesk {
 public:
  static constexpr std::int64_t kCollectNs = 100'000'000;  ///< joiners of one snapshot
  /// A joiner that does not ask again gets another after this.
  static constexpr std::int64_t kPatienceNs = 5'000'000'000;

  /// True when the time has come to make one snapshot for all who are ready: they say `joining`, all three
  /// writers have matched their participant, they were not served for this attempt within 5 s, and where they
  /// were served before, their participant has not asked too often.
  [[nodiscard]] bool due(Roster& roster, transport::ServerPort& port, std::int64_t now_ns);
  /// One was queued for those who were ready at the last due().
  void served(Roster& roster, std::int64_t now_ns);
  [[nodiscard]] static bool anybody(const std::map<transport::ClientId, Account>& accounts);
  /// When the joiners collected so far get theirs.
  [[nodiscard]] std::optional<std::int64_t> due_ns() const;

 private:
  std::optional<std::int64_t> collecting_since_ns_;
  std::vector<transport::ClientId> ready_;
};

}  // namespace tandem::host
