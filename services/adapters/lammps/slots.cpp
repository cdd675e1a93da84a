// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/slots.hpp"

#include <algorithm>
#include <cstring>

namespace tandem_lammps {
namespace {

// Ids below it are looked up in a vector, which takes 64 MB at most. Pours reach larger ones in the course of
// days.
constexpr std::int64_t kNear = 1 << 24;

}  // namespace

Slots::Slots(std::uint32_t capacity) : ids_(capacity), births_(capacity), alive_(capacity), seen_(capacity) {}

std::uint32_t Slots::find(std::int64_t id) const {
  if (id < 0) return kNone;
  if (id < kNear)
    return static_cast<std::size_t>(id) < near_.size() ? near_[static_cast<std::size_t>(id)] : kNone;
  const auto found = far_.find(id);
  return found == far_.end() ? kNone : found->second;
}

void Slots::enter(std::int64_t id, std::uint32_t slot) {
  ids_[slot] = id;
  if (id >= kNear) {
    far_[id] = slot;
    return;
  }
  const auto at = static_cast<std::size_t>(id);
  if (at >= near_.size()) near_.resize(std::max(at + 1, near_.size() * 2), kNone);
  near_[at] = slot;
}

void Slots::forget(std::int64_t id) {
  if (id < kNear) {
    near_[static_cast<std::size_t>(id)] = kNone;
  } else {
    far_.erase(id);
  }
}

void Slots::renew(std::uint32_t slot) {
  births_[slot] = static_cast<std::uint8_t>(births_[slot] % 255 + 1);
  if (alive_[slot] != 0) alive_[slot] = births_[slot];
}

std::uint32_t Slots::place_for(std::int64_t id) {
  if (id >= 1 && id <= static_cast<std::int64_t>(ids_.size()) && ids_[static_cast<std::size_t>(id - 1)] == 0)
    return static_cast<std::uint32_t>(id - 1);
  while (lowest_free_ < ids_.size() && ids_[lowest_free_] != 0) ++lowest_free_;
  return lowest_free_ < ids_.size() ? lowest_free_ : kNone;
}

std::span<const std::uint32_t> Slots::assign(std::span<const std::int64_t> ids) {
  ++call_;
  slots_.resize(ids.size());
  new_.clear();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    slots_[i] = find(ids[i]);
    if (slots_[i] == kNone) {
      new_.push_back(i);
    } else {
      seen_[slots_[i]] = call_;
    }
  }
  gone_ = 0;
  for (std::uint32_t s = 0; s < ids_.size(); ++s) {
    if (ids_[s] == 0 || seen_[s] == call_) continue;
    forget(ids_[s]);
    ids_[s] = 0;
    alive_[s] = 0;
    lowest_free_ = std::min(lowest_free_, s);
    ++gone_;
  }
  left_out_ = 0;
  std::ranges::sort(new_, {}, [&ids](std::size_t i) { return ids[i]; });
  for (const std::size_t i : new_) {
    const std::uint32_t slot = ids[i] >= 1 ? place_for(ids[i]) : kNone;
    if (slot == kNone) {
      ++left_out_;
      continue;
    }
    enter(ids[i], slot);
    seen_[slot] = call_;
    slots_[i] = slot;
    alive_[slot] = 1;
    renew(slot);
  }
  return slots_;
}

std::vector<std::uint8_t> Slots::save() const {
  std::vector<std::uint8_t> bytes(ids_.size() * 9);
  std::memcpy(bytes.data(), ids_.data(), ids_.size() * 8);
  std::memcpy(bytes.data() + ids_.size() * 8, births_.data(), births_.size());
  return bytes;
}

bool Slots::load(std::span<const std::uint8_t> bytes) {
  const std::size_t capacity = ids_.size();
  if (bytes.size() != capacity * 9) return false;
  Slots other(static_cast<std::uint32_t>(capacity));
  std::vector<std::int64_t> ids(capacity);
  std::memcpy(ids.data(), bytes.data(), capacity * 8);
  std::memcpy(other.births_.data(), bytes.data() + capacity * 8, capacity);
  for (std::uint32_t s = 0; s < capacity; ++s) {
    if (ids[s] == 0) continue;
    if (ids[s] < 0 || other.births_[s] == 0 || other.find(ids[s]) != kNone) return false;
    other.enter(ids[s], s);
    other.alive_[s] = other.births_[s];
  }
  *this = std::move(other);
  return true;
}

}  // namespace tandem_lammps
