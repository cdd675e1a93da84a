#include "sdk/client/session/told_news.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::client {

void ToldNews::enter(Epoch epoch, std::optional<Frame> shared) {
  if (std::exchange(epoch_, epoch) == epoch) return;
  forget_kept();
  keys_are_old_ = true;
  if (!shared) {
    joined_ = false;
    marks_.clear();
    return;
  }
  if (!joined_ || frame_ <= *shared) return;
  std::uint64_t count = count_;
  while (!marks_.empty() && marks_.back().frame > *shared) {
    count = marks_.back().before;
    marks_.pop_back();
  }
  const std::uint64_t back = count_ - count;
  frame_ = *shared;
  count_ = count;
  if (back > 0) listener_->on_events_taken_back(epoch_, frame_, back);
}

void ToldNews::tell_lost(Frame frame, std::uint64_t count) {
  if (count <= count_) return;
  listener_->on_events_lost(epoch_, frame, count - count_);
  count_ = count;
}

void ToldNews::on_loaded(const ClientTimeline& timeline) {
  const SessionWorld* const world = timeline.world();
  if (world == nullptr) return tell_all_keys(timeline.applied(), {});
  const Frame frame = timeline.applied();
  if (!std::exchange(joined_, true)) {  // what happened before is not told
    frame_ = frame;
    count_ = world->event_count();
  }
  keys_are_old_ = true;
  if (frame < frame_) return;  // older than what was told
  tell_lost(frame, world->event_count());
  frame_ = frame;
  tell_all_keys(frame, world->keys());
}

void ToldNews::on_applied(const ClientTimeline& timeline) {
  const SessionWorld* const world = timeline.world();
  const Frame frame = timeline.applied();
  if (world == nullptr || frame <= frame_) return;
  TANDEM_ASSERT(joined_);
  const News& news = timeline.news();
  tell({frame, world->event_count() - news.events.size(), world->event_count()}, news.events);
  if (keys_are_old_) {
    tell_all_keys(frame, world->keys());
  } else {
    tell_keys(frame, news);
  }
}

void ToldNews::tell(const Mark& mark, const std::vector<WorldEvent>& events) {
  TANDEM_ASSERT(mark.frame > frame_);
  frame_ = mark.frame;
  tell_lost(mark.frame, mark.before);
  std::uint64_t number = mark.before;
  for (const WorldEvent& event : events) listener_->on_happened({epoch_, mark.frame, ++number, event});
  count_ = std::max(count_, mark.after);
  if (events.empty()) return;
  marks_.push_back(mark);
  if (marks_.size() > kMaxMarks) marks_.pop_front();
}

void ToldNews::tell_keys(Frame frame, const News& news) {
  for (const KeyChange& change : news.keys) {
    if (change.value) {
      keys_.insert_or_assign(std::string(change.key),
                             std::vector(change.value->begin(), change.value->end()));
    } else if (const auto known = keys_.find(change.key); known != keys_.end()) {
      keys_.erase(known);
    }
    listener_->on_key(epoch_, frame, change);
  }
}

void ToldNews::tell_all_keys(Frame frame, const SessionWorld::Keys& now) {
  keys_are_old_ = false;
  for (auto known = keys_.begin(); known != keys_.end();) {
    if (now.contains(known->first)) {
      ++known;
      continue;
    }
    const std::string gone = known->first;
    known = keys_.erase(known);
    listener_->on_key(epoch_, frame, {gone, std::nullopt});
  }
  for (const auto& [key, value] : now) {
    const auto known = keys_.find(key);
    if (known != keys_.end() && known->second == value) continue;
    keys_.insert_or_assign(key, value);
    listener_->on_key(epoch_, frame, {key, value});
  }
}

void ToldNews::keep(const ClientTimeline& other) {
  const SessionWorld* const world = other.world();
  const Frame frame = other.applied();
  if (world == nullptr || frame <= frame_ || other.news().events.empty()) return;
  const std::vector<WorldEvent>& events = other.news().events;
  Kept& kept = kept_.emplace_back(
      Kept{{frame, world->event_count() - events.size(), world->event_count()}, events, {}});
  for (const WorldEvent& event : events)
    kept.bytes.insert(kept.bytes.end(), event.bytes.begin(), event.bytes.end());
  std::span<const std::byte> left = kept.bytes;
  for (WorldEvent& event : kept.events) {
    event.bytes = left.first(event.bytes.size());
    left = left.subspan(event.bytes.size());
  }
  kept_bytes_ += kept.bytes.size() + events.size() * sizeof(WorldEvent);
  if (kept_bytes_ > kMaxKeptBytes) forget_kept();  // they are then told as lost
}

void ToldNews::move_over(const ClientTimeline& other) {
  const SessionWorld* const world = other.world();
  const bool is_ahead = other.applied() > frame_;
  for (const Kept& kept : kept_) {
    if (kept.mark.frame > frame_ && kept.mark.frame <= other.applied()) tell(kept.mark, kept.events);
  }
  forget_kept();
  if (world == nullptr || !is_ahead) return;
  frame_ = other.applied();
  tell_lost(frame_, world->event_count());
  tell_all_keys(frame_, world->keys());
}

void ToldNews::forget_kept() {
  kept_.clear();
  kept_bytes_ = 0;
}

}  // namespace tandem::client
