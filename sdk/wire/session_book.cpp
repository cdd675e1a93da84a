#include "sdk/wire/session_book.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::transport {
namespace {
// Sessions have one server, for a moment two. A host that announces from many participants must not fill this
// process's memory.
constexpr std::size_t kMaxEntries = 64;
}  // namespace

void SessionBook::put(std::uint64_t writer, Received<SessionMessage> announcement) {
  const auto known = std::ranges::find_if(
      entries_, [&](const Entry& entry) { return entry.announcement.from == announcement.from; });
  Entry entry{.writer = writer, .version = ++versions_, .announcement = std::move(announcement)};
  if (known == entries_.end()) {
    if (entries_.size() >= kMaxEntries) make_room();
    entries_.push_back(std::move(entry));
    return;
  }
  if (current_ == known->writer) current_ = writer;
  const bool back_of_the_line = known->passed_over.has_value();
  *known = std::move(entry);
  if (back_of_the_line) std::rotate(known, known + 1, entries_.end());
}

void SessionBook::make_room() {
  auto least = std::ranges::find_if(entries_, [](const Entry& entry) { return !entry.live; });
  const auto other = [this](const Entry& entry) { return entry.writer != current_; };
  if (least == entries_.end() || !other(*least)) least = std::ranges::find_if(entries_, other);
  TANDEM_ASSERT(least != entries_.end() && other(*least));
  entries_.erase(least);
}

void SessionBook::update(const StateOf& state_of) {
  std::erase_if(entries_, [&](Entry& entry) {
    const WriterState state = state_of(entry.writer, entry.announcement.from);
    if (state == WriterState::kGone && entry.serves()) ended_ = entry.announcement.message.epoch;
    entry.live = state == WriterState::kLive;
    return state == WriterState::kGone;
  });
}

void SessionBook::take_current(std::vector<Received<SessionMessage>>& out) {
  const auto usable = [](const Entry& entry) { return entry.serves() && !entry.passed_over; };
  auto current = std::ranges::find_if(
      entries_, [&](const Entry& entry) { return entry.writer == current_ && usable(entry); });
  if (current == entries_.end()) current = std::ranges::find_if(entries_, usable);
  if (current == entries_.end()) {
    for (Entry& entry : entries_) {
      if (entry.passed_over == PassOver::kWhileThereIsAnother) entry.passed_over.reset();
    }
    current = std::ranges::find_if(entries_, usable);
  }
  const std::uint64_t version = current == entries_.end() ? 0 : current->version;
  if (version != 0 && version != reported_) out.push_back(current->announcement);
  reported_ = version;
  current_ = version == 0 ? std::nullopt : std::optional(current->writer);
}

// An announcement of it that comes later puts the one that is passed over at the end of the line.
void SessionBook::pass_over_for_successor() {
  const auto current =
      std::ranges::find_if(entries_, [this](const Entry& entry) { return entry.writer == current_; });
  if (current == entries_.end()) return;
  const auto successor = std::ranges::find_if(entries_, [&](const Entry& entry) {
    return entry.serves() && !entry.passed_over &&
           entry.announcement.message.continues_epoch == current->announcement.message.epoch;
  });
  if (successor == entries_.end()) return;
  current->passed_over = PassOver::kWhileThereIsAnother;
  current_ = successor->writer;
}

void SessionBook::pass_over_current(PassOver until) {
  if (until == PassOver::kForItsSuccessor) return pass_over_for_successor();
  for (Entry& entry : entries_) {
    if (entry.writer == current_) entry.passed_over = until;
  }
}

void SessionBook::list_live(std::vector<Received<SessionMessage>>& out) const {
  for (const Entry& entry : entries_) {
    if (entry.live) out.push_back(entry.announcement);
  }
}

bool SessionBook::any_live() const {
  return std::any_of(entries_.begin(), entries_.end(), [](const Entry& entry) { return entry.serves(); });
}

bool SessionBook::epoch_live(Epoch epoch) const {
  return std::any_of(entries_.begin(), entries_.end(), [epoch](const Entry& entry) {
    return entry.serves() && entry.announcement.message.epoch == epoch;
  });
}

}  // namespace tandem::transport
