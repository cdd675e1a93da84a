#include "services/gateway/viewing/live_log.hpp"

#include <algorithm>
#include <utility>

namespace tandem::gateway {

void LiveLog::push_delta(OutgoingPtr message, Frame frame, std::uint64_t last_input, std::int64_t now_ns,
                         std::uint32_t earlier, std::size_t payload_bytes) {
  TANDEM_ASSERT(earlier < frame);
  push({std::move(message), frame, last_input, now_ns, pushed_, earlier, payload_bytes});
}

void LiveLog::push_input(OutgoingPtr message, std::uint64_t number, std::int64_t now_ns) {
  push({std::move(message), 0, number, now_ns, pushed_, 0, 0});
}

void LiveLog::push(Entry entry) {
  const std::int64_t now_ns = entry.at_ns;
  pushed_ += entry.message->size();
  entries_.push_back(std::move(entry));
  while (entries_.size() > 1 &&
         (bytes_from(begin_) > most_bytes_ || now_ns - entries_.front().at_ns > kLongestNs)) {
    entries_.pop_front();
    ++begin_;
    whole_ = false;
  }
}

std::optional<LiveLog::Place> LiveLog::after(Frame frame) const {
  const auto is_delta = [](const Entry& entry) { return entry.frame != 0; };
  const auto held = std::find_if(entries_.begin(), entries_.end(),
                                 [frame](const Entry& entry) { return frame != 0 && entry.tells(frame); });
  if (held == entries_.end()) {
    // The log begins behind that frame, and has all scheduled inputs since then.
    const auto first = std::find_if(entries_.begin(), entries_.end(), is_delta);
    const bool follows = whole_ && first != entries_.end() && first->tells(frame + 1);
    return follows ? std::optional(begin_) : std::nullopt;
  }
  const auto lacked = std::find_if(entries_.begin(), held, [&](const Entry& entry) {
    return entry.frame == 0 && entry.input > held->input;
  });
  // A message that tells later frames, too, is sent again.
  const auto behind = held->frame == frame ? held + 1 : held;
  return begin_ + static_cast<Place>((lacked == held ? behind : lacked) - entries_.begin());
}

LiveLog::Place LiveLog::shared_until(Place place, Place until, std::uint32_t max_frames,
                                     std::size_t max_bytes) const {
  const Entry& first = entry(place);
  Place next = place + 1;
  if (first.frame == 0) return next;
  std::size_t bytes = joined_bytes(place);
  while (next < until) {
    const Entry& other = entry(next);
    const bool follows = other.frame != 0 && other.frame - other.earlier == entry(next - 1).frame + 1 &&
                         other.input == first.input;
    bytes += joined_bytes(next);
    if (!follows || bytes > max_bytes || other.frame - (first.frame - first.earlier) >= max_frames) break;
    ++next;
  }
  return next;
}

// Places continue, so that an old place is never valid again.
void LiveLog::clear() {
  begin_ = end();
  entries_.clear();
  whole_ = true;
}

}  // namespace tandem::gateway
