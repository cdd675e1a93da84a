#include "services/gateway/viewing/live_log.hpp"

#include <utility>

namespace tandem::gateway {

void LiveLog::push(OutgoingPtr message, std::int64_t now_ns) {
  const std::size_t size = message->size();
  entries_.push_back({std::move(message), now_ns, pushed_});
  pushed_ += size;
  while (entries_.size() > 1 &&
         (bytes_from(begin_) > most_bytes_ || now_ns - entries_.front().at_ns > kLongestNs)) {
    entries_.pop_front();
    ++begin_;
  }
}

// Places continue, so that an old place is never valid again.
void LiveLog::clear() {
  begin_ = end();
  entries_.clear();
}

}  // namespace tandem::gateway
