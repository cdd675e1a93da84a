#include "services/accounts/outcomes.hpp"

#include <algorithm>

namespace tandem::accounts {

void Outcomes::add(const transport::ReplyEntry& entry, std::int64_t now_ns) {
  if (outcomes_.size() == transport::kReplyRing) outcomes_.erase(outcomes_.begin());
  outcomes_.push_back({entry, now_ns});
}

bool Outcomes::has(std::uint64_t number) const {
  return std::ranges::any_of(outcomes_,
                             [number](const Outcome& outcome) { return outcome.entry.number == number; });
}

std::vector<transport::ReplyEntry> Outcomes::told(std::int64_t now_ns) const {
  std::vector<transport::ReplyEntry> entries;
  for (const Outcome& outcome : outcomes_) {
    if (now_ns - outcome.at_ns <= kToldNs) entries.push_back(outcome.entry);
  }
  return entries;
}

}  // namespace tandem::accounts
