#include "services/engine/particles/strays.hpp"

#include <algorithm>

namespace tandem::engine {

void Strays::clear() {
  if (!strays_.empty()) std::fill(heads_.begin(), heads_.end(), kNone);
  strays_.clear();
  free_ = kNone;
}

void Strays::add(const Stray& stray) {
  std::uint32_t at = free_;
  if (at != kNone) {
    free_ = strays_[at].next;
    strays_[at] = stray;
  } else {
    at = static_cast<std::uint32_t>(strays_.size());
    strays_.push_back(stray);
  }
  std::uint32_t& head = heads_[bucket(stray.cell)];
  strays_[at].next = head;
  head = at;
}

void Strays::remove(std::uint32_t cell, std::uint32_t place) {
  std::uint32_t* at = &heads_[bucket(cell)];
  while (strays_[*at].place != place) at = &strays_[*at].next;
  const std::uint32_t removed = *at;
  *at = strays_[removed].next;
  strays_[removed].next = free_;
  free_ = removed;
}

}  // namespace tandem::engine
