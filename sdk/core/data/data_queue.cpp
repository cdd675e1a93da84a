#include "sdk/core/data/data_queue.hpp"

#include <algorithm>

namespace tandem {

std::span<const std::byte> DataQueue::next(BodyData& data, std::span<const std::byte> target,
                                           const BodyData::Lives& lives, std::size_t most_bytes) {
  ++frame_;
  data.keep();
  data.list_changed(target, lives, changed_);
  std::span<const std::byte> section;
  chosen_.clear();
  if (!changed_.empty()) {
    section = data.encode(target, changed_, lives);
    chosen_ = changed_;
    if (section.size() > most_bytes) section = oldest(data, target, lives, most_bytes, section.size());
  }
  waiting_ = changed_.size() - chosen_.size();
  if (waiting_ == 0) {
    std::fill(since_.begin(), since_.end(), 0U);
    return section;
  }
  for (const Slot slot : chosen_) since_[slot] = 0;
  return section;
}

std::span<const std::byte> DataQueue::oldest(BodyData& data, std::span<const std::byte> target,
                                             const BodyData::Lives& lives, std::size_t most_bytes,
                                             std::size_t of_all) {
  since_.resize(capacity_);
  std::vector<Slot> order = changed_;
  for (const Slot slot : order)
    if (since_[slot] == 0) since_[slot] = frame_;
  std::sort(order.begin(), order.end(),
            [&](Slot a, Slot b) { return since_[a] != since_[b] ? since_[a] < since_[b] : a < b; });
  // Changes cost about the same; a share that turns out too long is cut again.
  std::size_t count = order.size();
  for (std::size_t size = of_all; size > most_bytes;) {
    count = std::min(count - 1, count * most_bytes / size);
    if (count == 0) {
      chosen_.clear();
      data.keep();
      return {};
    }
    chosen_.assign(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
    std::sort(chosen_.begin(), chosen_.end());
    const std::span<const std::byte> section = data.encode(target, chosen_, lives);
    if (section.size() <= most_bytes) return section;
    size = section.size();
  }
  return {};
}

}  // namespace tandem
