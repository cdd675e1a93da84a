#include "sdk/transport/session_book.hpp"

#include <algorithm>
#include <utility>

namespace tandem::transport {
namespace {
// Sessions have one server, for a moment two; somebody who announces from many writers must not fill our
// memory.
constexpr std::size_t kMaxWriters = 64;
}  // namespace

void SessionBook::put(std::uint64_t writer, Received<SessionMessage> announcement) {
  std::erase_if(entries_, [writer](const Entry& entry) { return entry.writer == writer; });
  if (entries_.size() >= kMaxWriters) entries_.erase(entries_.begin());
  entries_.push_back(Entry{writer, next_order_++, true, std::move(announcement)});
}

void SessionBook::update(const StateOf& state_of) {
  std::erase_if(entries_, [&](Entry& entry) {
    const WriterState state = state_of(entry.writer, entry.announcement.from);
    entry.live = state == WriterState::kLive;
    return state == WriterState::kGone;
  });
}

void SessionBook::take_current(std::vector<Received<SessionMessage>>& out) {
  const auto current =
      std::find_if(entries_.rbegin(), entries_.rend(), [](const Entry& entry) { return entry.live; });
  const std::uint64_t order = current == entries_.rend() ? 0 : current->order;
  if (order != 0 && order != reported_) out.push_back(current->announcement);
  reported_ = order;
}

void SessionBook::list_live(std::vector<Received<SessionMessage>>& out) const {
  for (const Entry& entry : entries_) {
    if (entry.live) out.push_back(entry.announcement);
  }
}

bool SessionBook::any_live() const {
  return std::any_of(entries_.begin(), entries_.end(), [](const Entry& entry) { return entry.live; });
}

bool SessionBook::epoch_live(Epoch epoch) const {
  return std::any_of(entries_.begin(), entries_.end(), [epoch](const Entry& entry) {
    return entry.live && entry.announcement.message.epoch == epoch;
  });
}

}  // namespace tandem::transport
