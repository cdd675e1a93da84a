#pragma once
// Snapshots on demand.

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "sdk/transport/port.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/clients/snapshot_transfer.hpp"

namespace tandem::host {

/// Decides when a snapshot of one stream is made, and for whom.
class JoinDesk {
 public:
  explicit JoinDesk(std::uint32_t stream) : stream_(stream) {}

  /// True when the time has come to make one snapshot for all who are ready: they say `joining` and
  /// name the stream, all writers that they need have matched their participant, they are not being sent one,
  /// they were not served for this attempt, and where they were served before, their participant has not
  /// asked too often. While `transfer` has no memory for another there is none.
  [[nodiscard]] bool due(Roster& roster, transport::ServerPort& port, const SnapshotTransfer& transfer,
                         std::int64_t now_ns);
  /// Who was ready at the last due().
  [[nodiscard]] std::span<const transport::ClientId> ready() const { return ready_; }
  /// One was made for them.
  void served(Roster& roster, std::int64_t now_ns);
  /// When the joiners collected so far get theirs.
  [[nodiscard]] std::optional<std::int64_t> due_ns(const SnapshotTransfer& transfer,
                                                   std::int64_t now_ns) const;

 private:
  std::uint32_t stream_;
  std::optional<std::int64_t> collecting_since_ns_;
  std::optional<std::int64_t> served_at_ns_;
  std::vector<transport::ClientId> ready_;
};

}  // namespace tandem::host
