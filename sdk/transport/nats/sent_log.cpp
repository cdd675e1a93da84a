#include "sdk/transport/nats/sent_log.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::transport::nats {

void SentLog::add(std::uint64_t number, Message message, std::int64_t now_ns) {
  TANDEM_ASSERT(message != nullptr);
  const std::uint64_t end = first_ + entries_.size();
  const bool again = !entries_.empty() && number + 1 == end;
  if (!again) {
    if (number != end || entries_.empty()) {
      entries_.clear();
      bytes_ = 0;
      first_ = number;
    }
    entries_.push_back({{}, 0, now_ns});
  }
  Entry& entry = entries_.back();
  entry.bytes += message->size();
  bytes_ += message->size();
  entry.messages.push_back(std::move(message));
  while (entries_.size() > 1 && (bytes_ > most_bytes_ || now_ns - entries_.front().at_ns > kKeptNs)) {
    TANDEM_ASSERT(entries_.front().bytes <= bytes_);
    bytes_ -= entries_.front().bytes;
    entries_.pop_front();
    ++first_;
  }
}

Beat::Range SentLog::range() const { return {.oldest = first_, .newest = first_ + entries_.size() - 1}; }

std::size_t SentLog::list(std::uint64_t first, std::uint32_t count, std::size_t most_bytes,
                          std::vector<Message>& out) const {
  std::size_t bytes = 0;
  const std::uint64_t from = std::max(first, first_);
  const std::uint64_t end = std::min(first + count, first_ + entries_.size());
  for (std::uint64_t number = from; number < end; ++number) {
    const Entry& entry = entries_[static_cast<std::size_t>(number - first_)];
    if (bytes > 0 && bytes + entry.bytes > most_bytes) break;
    bytes += entry.bytes;
    out.insert(out.end(), entry.messages.begin(), entry.messages.end());
  }
  return bytes;
}

}  // namespace tandem::transport::nats
