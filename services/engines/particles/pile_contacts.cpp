// Forces, and which blocks sleep.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>

#include "services/engines/particles/pile.hpp"

namespace tandem::engine {
namespace {

// Blocks that a thread takes at once: few, because all wait for the last.
constexpr std::uint32_t kBlocksAtOnce = 8;
// A body that is faster than so many times the speed below which bodies fall asleep wakes what it touches.
constexpr float kWakes = 4;
constexpr std::uint32_t kWholeGroup = (1U << kGroup) - 1U;

// A byte a body of a group; element-wise operations only.
using GroupBytes = std::uint8_t __attribute__((vector_size(kGroup)));

GroupBytes all(std::uint8_t value) { return GroupBytes{} + value; }

// A byte a bit: 0xFF where it is set.
GroupBytes spread(std::uint32_t bits) {
  constexpr std::uint64_t kEach = 0x0101010101010101;
  const std::array<std::uint64_t, 2> halves{(bits & 0xFFU) * kEach, (bits >> 8U & 0xFFU) * kEach};
  GroupBytes bytes;
  std::memcpy(&bytes, &halves, sizeof bytes);
  constexpr GroupBytes kBits{1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
  return reinterpret_cast<GroupBytes>((bytes & kBits) == kBits);
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
  const bool many = moved_.size() > count_ / kMaxMoved ||
                    (std::size_t{strays_.size()} + moved_.size()) * kMaxAdopted > count_;
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
  Look& look = scratch_->looks.front();
  look_around(grid_.cell_of(at[0], at[1], at[2]), scratch_->rows, look);
  for (const std::uint32_t place :
       find_near({at[0], at[1], at[2], radius + usual_skin_, kNoPlace}, look, *scratch_))
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
  const bool lasts = skin_ != 0 && !crowded_ && rows <= kRows;
  if (lasts) known = static_cast<std::uint8_t>(rows);
  if (skin_ != 0 && !crowded_ && rows > kRows) known = kSpilled;
  std::uint32_t* const to = lasts ? kept : scratch.entries.data();
  weave(scratch, rows, to);
  entries = to;
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
    // The next group's list is as long, and begins where no processor expects it.
    for (std::uint32_t row = 0; row < std::min(rows, kRows); ++row)
      __builtin_prefetch(&entries_[(std::size_t{group + 1} * kRows + row) * kGroup]);
    Sums sums{};
    kernels_->add_planes(records_.data(), first, world_->planes, world_->wall, sums);
    if (!surfaces_.empty()) surfaces_.add(records_.data(), first, sums);
    kernels_->add_partners(records_.data(), first, entries, rows, world_->pair, sums);
    Speeds speeds;
    kernels_->judge_speeds(records_.data(), first, slow, fast, speeds);
    const std::uint32_t touching = sums.touching & speeds.living;
    all_touching += static_cast<std::uint32_t>(std::popcount(touching));
    if (speeds.living == kWholeGroup) {
      forces_[group] = sums;
    } else {
      for (std::uint32_t left = speeds.living; left != 0; left &= left - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
        set_force(first + lane, {sums.x[lane], sums.y[lane], sums.z[lane]});
      }
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
  const GroupBytes lives = spread(living), calms = spread(calm != nullptr ? *calm : 0);
  const auto kept = static_cast<std::uint8_t>(calm != nullptr ? kAdopted : ~kTouching);
  GroupBytes was;
  std::memcpy(&was, &state_[first], sizeof was);
  const GroupBytes longer = (was & kQuietMask) + 1, most = all(kQuietSteps);
  const auto too_long = reinterpret_cast<GroupBytes>(longer > most);
  const GroupBytes quiet = ((longer & ~too_long) | (most & too_long)) & calms;
  const GroupBytes is = (was & kept) | quiet | (spread(touching) & kTouching);
  const GroupBytes states = (is & lives) | (was & ~lives);
  std::memcpy(&state_[first], &states, sizeof states);
  const GroupBytes restless = (states & kQuietMask) ^ most;
  std::array<std::uint64_t, 2> halves;
  std::memcpy(&halves, &restless, sizeof halves);
  return (halves[0] | halves[1]) == 0;
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
