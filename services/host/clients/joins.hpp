#pragma once
// Snapshots for joining clients.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/wire/port.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/clients/snapshot_transfer.hpp"

namespace tandem::host {

/// Decides when a snapshot of one stream is made, and for which clients.
class JoinDesk {
 public:
  explicit JoinDesk(std::uint32_t stream) : stream_(stream) {}

  /// True if it is time to make one snapshot for all clients that are ready. A ready client says `joining`
  /// and names the stream; all writers that it needs have matched its participant; it is not being sent a
  /// snapshot; it was not served for this attempt; and if it was served before, its participant has not asked
  /// too often. There is no snapshot while `transfer` has no memory for another.
  [[nodiscard]] bool due(Roster& roster, transport::ServerPort& port, const SnapshotTransfer& transfer,
                         std::int64_t now_ns);
  /// The clients that were ready at the last due().
  [[nodiscard]] std::span<const transport::ClientId> ready() const { return ready_; }
  /// Notes that a snapshot was made for the ready clients.
  void served(Roster& roster, std::int64_t now_ns);
  /// Snapshots for clients that had got one before and did not play when they asked for this one.
  [[nodiscard]] std::uint64_t rejoins() const { return rejoins_; }
  /// When the joiners that were collected so far get their snapshot.
  [[nodiscard]] std::optional<std::int64_t> due_ns(const SnapshotTransfer& transfer,
                                                   std::int64_t now_ns) const;

 private:
  std::uint32_t stream_;
  std::optional<std::int64_t> collecting_since_ns_;
  std::optional<std::int64_t> served_at_ns_;
  std::vector<transport::ClientId> ready_;
  std::uint64_t rejoins_ = 0;
};

}  // namespace tandem::host
