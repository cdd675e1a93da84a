#include "services/host/accounts/outcomes.hpp"

#include <algorithm>
#include <utility>

#include "sdk/wire/limits.hpp"

namespace tandem::accounts {

void Outcomes::add(const transport::ReplyEntry& entry, std::int64_t now_ns, std::string text) {
  if (outcomes_.size() == transport::kReplyRing) outcomes_.erase(outcomes_.begin());
  outcomes_.push_back({entry, now_ns, std::move(text)});
}

bool Outcomes::has(std::uint64_t number) const {
  return std::ranges::any_of(outcomes_,
                             [number](const Outcome& outcome) { return outcome.entry.number == number; });
}

void Outcomes::take_back(std::uint64_t number) {
  std::erase_if(outcomes_, [number](const Outcome& outcome) { return outcome.entry.number == number; });
}

void Outcomes::renew(std::int64_t now_ns) {
  for (Outcome& outcome : outcomes_) outcome.at_ns = now_ns;
}

std::vector<transport::ReplyEntry> Outcomes::entries() const {
  std::vector<transport::ReplyEntry> entries;
  for (const Outcome& outcome : outcomes_) entries.push_back(outcome.entry);
  return entries;
}

void Outcomes::tell(transport::ReplyMessage& reply, std::int64_t now_ns) const {
  reply.entries.clear();
  reply.texts.clear();
  for (const Outcome& outcome : outcomes_) {
    if (now_ns - outcome.at_ns > kToldNs) continue;
    reply.entries.push_back(outcome.entry);
    if (!outcome.text.empty()) reply.texts.push_back({outcome.entry.number, outcome.text});
  }
  if (reply.texts.size() > transport::kMaxReplyTexts)
    reply.texts.erase(reply.texts.begin(), reply.texts.end() - transport::kMaxReplyTexts);
}

}  // namespace tandem::accounts
