#include "services/gateway/entrance/visits.hpp"

#include <algorithm>
#include <utility>

namespace tandem::gateway {

Visits::Visits(const AddressLimits& limits, std::size_t most, const std::vector<std::string>& trusted_proxies)
    : addresses_(limits), most_(most) {
  for (const std::string& proxy : trusted_proxies) {
    if (const auto key = address_key(proxy)) trusted_.push_back(*key);
  }
}

bool Visits::is_trusted(const AddressKey& peer) const {
  return std::ranges::find(trusted_, peer) != trusted_.end();
}

tl::expected<Visit*, TurnedAway> Visits::arrive(const AddressKey& peer, std::int64_t now_ns) {
  if (visits_.size() >= most_) return tl::unexpected(TurnedAway::kFull);
  auto visit = std::make_unique<Visit>();
  visit->peer = visit->client = peer;
  visit->account = addresses_.of(peer);
  visit->due_ns = now_ns + kHandshakeNs;
  // Through a proxy, who comes is known with the first request.
  if (!is_trusted(peer)) {
    if (const auto why = addresses_.arrive(*visit->account, now_ns)) return tl::unexpected(*why);
    visit->counted = true;
  }
  const Visit* const key = visit.get();
  return visits_.emplace(key, std::move(visit)).first->second.get();
}

void Visits::leave(const Visit* visit) {
  const auto found = visits_.find(visit);
  if (found == visits_.end()) return;
  if (visit->counted) Addresses::leave(*visit->account, visit->greeted);
  visits_.erase(found);
}

void Visits::ask(Visit& visit, std::string_view forwarded_for) {
  visit.due_ns = INT64_MAX;
  const bool first = !std::exchange(visit.greeted, true);
  if (first && visit.counted) Addresses::greeted(*visit.account);
  if (visit.counted) return;
  visit.client = client_address(visit.peer, forwarded_for, trusted_);
  visit.account = addresses_.of(visit.client);
}

bool Visits::join(Visit& visit, std::int64_t now_ns) {
  if (!visit.counted) visit.counted = addresses_.arrive_behind_proxy(*visit.account);
  return visit.counted && visit.account->joins.take(now_ns);
}

void Visits::list_slow(std::int64_t now_ns, std::vector<Visit*>& out) {
  out.clear();
  for (const auto& [key, visit] : visits_) {
    if (now_ns < visit->due_ns) continue;
    visit->due_ns = INT64_MAX;
    out.push_back(visit.get());
  }
}

// TCP counts what no handler of messages sees: pings, and bodies of requests that are refused.
void Visits::list_floods(std::int64_t now_ns, const std::function<std::uint64_t(const Visit&)>& received_by,
                         std::vector<Visit*>& out) {
  constexpr auto kShare = static_cast<std::uint64_t>(kReceivedPerSecond / 10);
  out.clear();
  for (const auto& [key, visit] : visits_) {
    const std::uint64_t received = received_by(*visit);
    const std::uint64_t more = received - std::min(visit->received, received);
    visit->received = received;
    visit->account->received.spend(static_cast<double>(more));
    if (more > kShare && !visit->account->received.has(now_ns)) out.push_back(visit.get());
  }
}

void Visits::list_waiting(std::vector<Visit*>& out) {
  out.clear();
  for (const auto& [key, visit] : visits_) {
    if (std::exchange(visit->waits_for_bytes, false)) out.push_back(visit.get());
  }
}

}  // namespace tandem::gateway
