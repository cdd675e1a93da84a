#include "services/host/joins.hpp"

#include <algorithm>

namespace tandem::host {
namespace {

bool joins(const Account& account) { return account.present && account.phase == transport::Phase::kJoining; }

bool wants(const Account& account, std::int64_t now_ns) {
  const JoinAccount& join = account.join;
  return !join.served || join.served_attempt != account.attempt ||
         now_ns - join.served_at_ns >= JoinDesk::kPatienceNs;
}

}  // namespace

bool JoinDesk::due(Roster& roster, transport::ServerPort& port, std::int64_t now_ns) {
  ready_.clear();
  for (const auto& [id, account] : roster.accounts()) {
    if (!joins(account) || !wants(account, now_ns)) continue;
    if (account.join.served && !roster.peer(account).snapshots_again.has(now_ns)) continue;
    if (port.joined(account.from)) ready_.push_back(id);
  }
  if (ready_.empty()) {
    collecting_since_ns_.reset();
    return false;
  }
  if (!collecting_since_ns_) collecting_since_ns_ = now_ns;
  return now_ns - *collecting_since_ns_ >= kCollectNs;
}

void JoinDesk::served(Roster& roster, std::int64_t now_ns) {
  for (const transport::ClientId id : ready_) {
    const auto known = roster.accounts().find(id);
    if (known == roster.accounts().end()) continue;
    if (known->second.join.served) roster.peer(known->second).snapshots_again.take(now_ns);
    known->second.join = {.served = true, .served_attempt = known->second.attempt, .served_at_ns = now_ns};
  }
  collecting_since_ns_.reset();
}

bool JoinDesk::anybody(const std::map<transport::ClientId, Account>& accounts) {
  return std::ranges::any_of(accounts, [](const auto& entry) { return joins(entry.second); });
}

std::optional<std::int64_t> JoinDesk::due_ns() const {
  if (!collecting_since_ns_) return std::nullopt;
  return *collecting_since_ns_ + kCollectNs;
}

}  // namespace tandem::host
