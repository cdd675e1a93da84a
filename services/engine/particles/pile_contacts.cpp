// Forces, and which blocks sleep.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>

#include "services/engine/particles/pile.hpp"

namespace tandem::engine {
namespace {

// Blocks that a thread takes at once: few, because all wait for the last.
constexpr std::uint32_t kBlocksAtOnce = 8;
// A body that is faster than so many times the speed below which bodies fall asleep wakes what it touches.
constexpr float kWakes = 4;

using GroupBytes = std::array<std::uint8_t, kGroup>;

// A byte a bit: 0xFF where it is set.
GroupBytes spread(std::uint32_t bits) {
  GroupBytes bytes;
  for (std::uint32_t i = 0; i < kGroup; ++i) bytes[i] = static_cast<std::uint8_t>(-(bits >> i & 1U));
  return bytes;
}

}  // namespace

void Pile::list_awake() {
  awake_.clear();
  for (std::uint32_t block = 0; block < blocks(); ++block)
    if (asleep_[block] == 0) awake_.push_back(block);
}

void Pile::find_contacts(bool last) {
  if (skin_ != 0) gather_loose();
  // Bodies far from where they were sorted cost cache misses.
  const bool many =
      moved_.size() > count_ / kMostMoved || (std::size_t{adopted_} + moved_.size()) * kMostAdopted > count_;
  if (!sorted_ || crowded_ || skin_ == 0 || many) {
    sort();
  } else {
    adopt_moved();
  }
  wake_marked();
  list_awake();
  sum_blocks(awake_, true, last);
  for (std::uint32_t block = 0; sleeping_blocks_ > 0 && block < blocks(); ++block)
    any_marked_ = any_marked_ || marked_[block] != 0;
  if (wake_marked()) sum_blocks(woken_, false, false);
  if (last && sleep_speed_ > 0) fall_asleep();
}

void Pile::mark(std::uint32_t block) {
  marked_[block] = 1;
  any_marked_ = true;
}

// Wakes marked blocks; woken_ holds those that slept. Returns whether there were any.
bool Pile::wake_marked() {
  woken_.clear();
  if (!any_marked_) return false;
  any_marked_ = false;
  for (std::uint32_t block = 0; block < blocks(); ++block) {
    if (marked_[block] == 0) continue;
    marked_[block] = 0;
    if (asleep_[block] == 0) continue;
    asleep_[block] = 0;
    outside_[block] = loose_[block] = 0;
    --sleeping_blocks_;
    for (std::uint32_t place = block * kBlock; place < (block + 1) * kBlock; ++place)
      if (records_[place].slot != kNoSlot) state_[place] &= static_cast<std::uint8_t>(~kQuietMask);
    woken_.push_back(block);
  }
  if (!woken_.empty()) list_awake();
  return !woken_.empty();
}

void Pile::fall_asleep() {
  bool any = false;
  for (const std::uint32_t block : awake_) {
    if (quiet_[block] == 0) continue;
    any = true;
    asleep_[block] = 1;
    ++sleeping_blocks_;
    changed_[block] = 1;
    for (std::uint32_t place = block * kBlock; place < (block + 1) * kBlock; ++place)
      records_[place].vx = records_[place].vy = records_[place].vz = 0;
  }
  if (any) list_awake();
}

// Marks blocks whose bodies touch a body of that radius, or nearly.
void Pile::wake_near(const Vec3f& at, float radius) {
  if (!sorted_ || crowded_) return;
  for (const std::uint32_t place :
       find_near({at[0], at[1], at[2], radius + usual_skin_, kNoPlace}, *scratch_))
    mark(place / kBlock);
}

void Pile::sum_blocks(std::span<const std::uint32_t> blocks, bool regular, bool last) {
  workers_->run(static_cast<std::uint32_t>(blocks.size()), kBlocksAtOnce,
                [&](std::uint32_t begin, std::uint32_t end) {
                  Scratch scratch;
                  for (std::uint32_t i = begin; i < end; ++i) sum_block(blocks[i], scratch, regular, last);
                });
}

std::uint32_t Pile::lists_of(std::uint32_t group, Scratch& scratch, const std::uint32_t*& entries) {
  std::uint8_t& known = rows_[group];
  std::uint32_t* const kept = entries_.get() + std::size_t{group} * kRows * kGroup;
  if (known != kUnlisted && known != kSpilled) {
    entries = kept;
    return known;
  }
  const std::uint32_t rows = make_lists(group, scratch);
  entries = scratch.entries.data();
  if (skin_ == 0 || crowded_) return rows;
  known = rows <= kRows ? static_cast<std::uint8_t>(rows) : kSpilled;
  if (rows <= kRows) std::memcpy(kept, entries, std::size_t{rows} * kGroup * sizeof(std::uint32_t));
  return rows;
}

void Pile::sum_block(std::uint32_t block, Scratch& scratch, bool regular, bool last) {
  const float slow = sleep_speed_ * sleep_speed_, fast = slow * kWakes * kWakes;
  const bool tires = regular && last && sleep_speed_ > 0;
  std::uint32_t all_touching = 0;
  bool all_quiet = true;
  for (std::uint32_t group = block * kGroupsInBlock; group < (block + 1) * kGroupsInBlock; ++group) {
    const std::uint32_t first = group * kGroup;
    if (first >= count_) break;
    const std::uint32_t* entries = nullptr;
    const std::uint32_t rows = lists_of(group, scratch, entries);
    Sums sums{};
    kernels_->add_planes(records_.data(), first, world_->planes, world_->wall, sums);
    if (!surfaces_.empty()) surfaces_.add(records_.data(), first, sums);
    kernels_->add_partners(records_.data(), first, entries, rows, world_->pair, sums);
    Speeds speeds;
    kernels_->judge_speeds(records_.data(), first, slow, fast, speeds);
    const std::uint32_t touching = sums.touching & speeds.living;
    all_touching += static_cast<std::uint32_t>(std::popcount(touching));
    for (std::uint32_t lane = 0; lane < kGroup; ++lane) {
      if ((speeds.living >> lane & 1U) != 0)
        force_[first + lane] = {sums.x[lane], sums.y[lane], sums.z[lane], 0};
    }
    const std::uint32_t calm = touching & speeds.slow;
    all_quiet = note_states(first, speeds.living, touching, tires ? &calm : nullptr) && all_quiet;
    const std::uint32_t fast_lanes = tires ? speeds.fast : 0;
    if (fast_lanes != 0 && sleeping_blocks_ > 0) wake_touched(first, fast_lanes, entries, rows);
  }
  touching_[block] = static_cast<std::uint8_t>(all_touching);
  quiet_[block] = tires && all_quiet ? 1 : 0;
}

// Notes which bodies of a group touch something and, if `calm` says which are calm, for how long they were.
// Returns whether all have been for long enough.
bool Pile::note_states(std::uint32_t first, std::uint32_t living, std::uint32_t touching,
                       const std::uint32_t* calm) {
  const GroupBytes lives = spread(living), touches = spread(touching),
                   is_calm = spread(calm != nullptr ? *calm : 0);
  const auto kept = static_cast<std::uint8_t>(calm != nullptr ? kAdopted : ~kTouching);
  std::uint8_t* const states = &state_[first];
  std::uint8_t restless = 0;
  // Without branches, so that the compiler makes vectors of it.
  for (std::uint32_t lane = 0; lane < kGroup; ++lane) {
    const std::uint8_t was = states[lane];
    const auto longer = static_cast<std::uint8_t>((was & kQuietMask) + 1);
    const auto quiet = static_cast<std::uint8_t>(std::min(longer, kQuietSteps) & is_calm[lane]);
    const auto is = static_cast<std::uint8_t>((was & kept) | quiet | (touches[lane] & kTouching));
    states[lane] = static_cast<std::uint8_t>((is & lives[lane]) | (was & ~lives[lane]));
    restless |= static_cast<std::uint8_t>((states[lane] & kQuietMask) ^ kQuietSteps);
  }
  return restless == 0;
}

// Marks sleeping blocks with a body that one of these lanes touches.
void Pile::wake_touched(std::uint32_t first, std::uint32_t lanes, const std::uint32_t* entries,
                        std::uint32_t rows) {
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::uint32_t>(std::countr_zero(lanes));
    const Record& self = records_[first + lane];
    for (std::uint32_t row = 0; row < rows; ++row) {
      const std::uint32_t other = entries[row * kGroup + lane];
      if (other == most_places_) break;
      if (asleep_[other / kBlock] == 0) continue;
      const Record& r = records_[other];
      const float dx = r.x - self.x, dy = r.y - self.y, dz = r.z - self.z, reach = r.radius + self.radius;
      if (dx * dx + dy * dy + dz * dz < reach * reach)
        std::atomic_ref<std::uint8_t>(marked_[other / kBlock]).store(1, std::memory_order_relaxed);
    }
  }
}

}  // namespace tandem::engine
