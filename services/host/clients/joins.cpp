#include "services/host/clients/joins.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

bool JoinDesk::due(Roster& roster, transport::ServerPort& port, const SnapshotTransfer& transfer,
                   std::int64_t now_ns) {
  ready_.clear();
  const bool spaced = !served_at_ns_ || now_ns - *served_at_ns_ >= accounts::kSnapshotSpacingNs;
  const bool may_cut = spaced && !transfer.full(now_ns);
  bool someone_asks = false;
  for (const auto& [id, account] : roster.accounts()) {
    if (joined_stream(account) != stream_ || was_served(account) || transfer.serves(id, now_ns)) continue;
    if (account.join.served && !roster.peer(account).snapshots_again.has(now_ns)) continue;
    if (!account.open) continue;
    someone_asks = true;
    if (may_cut && port.joined(account.from, id, stream_))
      ready_.push_back(id);  // checked last, because it
                             // takes a while
  }
  if (may_cut ? ready_.empty() : !someone_asks) {
    collecting_since_ns_.reset();
    return false;
  }
  if (!collecting_since_ns_) collecting_since_ns_ = now_ns;
  return may_cut && now_ns - *collecting_since_ns_ >= accounts::kHostTransfers.collect_ns;
}

void JoinDesk::served(Roster& roster, std::int64_t now_ns) {
  TANDEM_ASSERT(!ready_.empty());
  for (const transport::ClientId id : ready_) {
    const auto known = roster.accounts().find(id);
    if (known == roster.accounts().end()) continue;
    if (known->second.join.served) {
      roster.peer(known->second).snapshots_again.take(now_ns);
      if (known->second.phase == transport::Phase::kJoining) ++rejoins_;
    }
    known->second.join = {.served = true, .served_attempt = known->second.attempt, .served_stream = stream_};
  }
  collecting_since_ns_.reset();
  served_at_ns_ = now_ns;
}

std::optional<std::int64_t> JoinDesk::due_ns(const SnapshotTransfer& transfer, std::int64_t now_ns) const {
  if (!collecting_since_ns_ || transfer.full(now_ns)) return std::nullopt;
  const std::int64_t spaced_ns = served_at_ns_ ? *served_at_ns_ + accounts::kSnapshotSpacingNs : INT64_MIN;
  return std::max(*collecting_since_ns_ + accounts::kHostTransfers.collect_ns, spaced_ns);
}

}  // namespace tandem::host
