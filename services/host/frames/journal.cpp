#include "services/host/frames/journal.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::host {

using transport::InputDecision;
using transport::JournalMessage;
using transport::JournalState;

void Journal::set_open(bool open) {
  if (open && !open_) ++number_;  // what happened meanwhile is missing
  open_ = open;
  noted_.clear();
}

void Journal::decided(const transport::InputMessage& input, const transport::ParticipantId& from,
                      const InputVerdict& verdict) {
  if (!open_) return;
  InputDecision decision;
  decision.client = input.client;
  decision.number = input.number;
  decision.frame = verdict.acts_on;
  decision.scheduled = verdict.scheduled;
  decision.code = static_cast<std::uint32_t>(verdict.reason);
  const auto bytes = std::as_bytes(std::span(from.bytes));
  decision.participant.assign(bytes.begin(), bytes.end());
  if (verdict.reason == transport::Reason::kNone) {  // otherwise nobody needs to know what it was
    decision.kind = input.kind;
    decision.values = input.values;
    decision.bytes = input.bytes;
  }
  noted_.push_back(std::move(decision));
}

void Journal::write(Frame next, std::int64_t now_ns) {
  if (!open_ || (noted_.empty() && now_ns - pushed_ns_ < kBeatNs)) return;
  std::size_t told = 0;
  do {
    JournalMessage entry;
    entry.frame = next;
    const std::size_t count = std::min(noted_.size() - told, transport::kMaxDecisions);
    const auto first = noted_.begin() + static_cast<std::ptrdiff_t>(told);
    entry.decisions.assign(std::make_move_iterator(first),
                           std::make_move_iterator(first + static_cast<std::ptrdiff_t>(count)));
    told += count;
    push(std::move(entry), now_ns);
  } while (told < noted_.size());
  noted_.clear();
}

void Journal::made(Frame frame, std::uint64_t hash, std::span<const std::byte> news, std::int64_t now_ns) {
  if (!open_) return;
  TANDEM_ASSERT(noted_.empty());
  JournalMessage entry;
  entry.frame = frame;
  entry.hash = hash;
  entry.state = JournalState::kMade;
  entry.news.assign(news.begin(), news.end());
  push(std::move(entry), now_ns);
}

void Journal::last(Frame frame, std::uint64_t hash, std::span<const std::byte> news,
                   transport::ClientId standby, std::int64_t now_ns) {
  JournalMessage entry;
  entry.frame = frame;
  entry.hash = hash;
  entry.state = JournalState::kLast;
  entry.news.assign(news.begin(), news.end());
  entry.successor = standby;
  push(std::move(entry), now_ns);
}

void Journal::push(JournalMessage entry, std::int64_t now_ns) {
  entry.epoch = epoch_;
  entry.number = ++number_;
  pushed_ns_ = now_ns;
  static_cast<void>(outbox_->push(std::move(entry)));
}

}  // namespace tandem::host
