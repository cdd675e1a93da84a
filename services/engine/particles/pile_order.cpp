// Places, anchors and lists.
#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <limits>
#include <thread>

#include "services/engine/particles/pile.hpp"

namespace tandem::engine {
namespace {

constexpr float kNotFound = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint32_t kPlacesAtOnce = 2048;

// Places of which all but the last few ascend.
void put_in_order(std::span<std::uint32_t> places) {
  constexpr std::size_t kMany = 200;
  if (places.size() > kMany) return std::sort(places.begin(), places.end());
  for (std::size_t i = 1; i < places.size(); ++i) {
    const std::uint32_t place = places[i];
    std::size_t at = i;
    for (; at > 0 && places[at - 1] > place; --at) places[at] = places[at - 1];
    places[at] = place;
  }
}

/// Of the lists of a group, for an insertion.
class GroupLock {
 public:
  explicit GroupLock(std::uint8_t& lock) : lock_(lock) {
    constexpr int kLooks = 1000;  // then whoever has it was interrupted
    for (int look = 0; lock_.exchange(1, std::memory_order_acquire) != 0; ++look)
      if (look >= kLooks) std::this_thread::yield();
  }
  ~GroupLock() { lock_.store(0, std::memory_order_release); }
  GroupLock(const GroupLock&) = delete;
  GroupLock& operator=(const GroupLock&) = delete;
  GroupLock(GroupLock&&) = delete;
  GroupLock& operator=(GroupLock&&) = delete;

 private:
  std::atomic_ref<std::uint8_t> lock_;
};

}  // namespace

void Pile::sort() {
  workers_->run(count_, kPlacesAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t place = begin; place < end; ++place) {
      const Record& r = records_[place];
      cell_[place] = r.slot == kNoSlot ? kNoCell : grid_.cell_of(r.x, r.y, r.z);
    }
  });
  grid_.arrange({cell_.data(), count_}, {to_.data(), count_}, *workers_, threads_);
  move_to_places();
  crowded_ = grid_.in_cells() < grid_.size();
  sorted_ = true;
  adopted_ = 0;
  moved_.clear();
  strays_.clear();
  std::fill(rows_.begin(), rows_.end(), kUnlisted);
  all_changed_ = true;
  settle_blocks();
}

// Moves each body to its place, makes that its anchor, and chooses the skin.
void Pile::move_to_places() {
  // Further than half the skin in a step, so that the list would not last the next one.
  const float h = world_->dt_s / static_cast<float>(world_->substeps);
  const float fast_squared = usual_skin_ * usual_skin_ / 4;
  const Vec3f mean = mean_velocity_;
  drift_ = {};
  const std::uint32_t in_cells = grid_.in_cells();
  std::atomic<std::uint32_t> fast = 0;
  workers_->run(count_, kPlacesAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    std::uint32_t some = 0;
    for (std::uint32_t from = begin; from < end; ++from) {
      const std::uint32_t place = to_[from];
      if (place == kNoPlace) continue;
      const Record& r = records_[from];
      spare_records_[place] = r;
      spare_inverse_mass_[place] = inverse_mass_[from];
      spare_state_[place] = state_[from] & static_cast<std::uint8_t>(~kAdopted);
      anchor_[0][place] = r.x;
      anchor_[1][place] = r.y;
      anchor_[2][place] = r.z;
      anchor_radius_[place] = place < in_cells ? r.radius : kNotFound;
      place_of_[r.slot] = place;
      const float vx = h * (r.vx - mean[0]), vy = h * (r.vy - mean[1]), vz = h * (r.vz - mean[2]);
      some += static_cast<std::uint32_t>(vx * vx + vy * vy + vz * vz > fast_squared);
    }
    fast += some;
  });
  records_.swap(spare_records_);
  inverse_mass_.swap(spare_inverse_mass_);
  state_.swap(spare_state_);
  const std::uint32_t before = count_;
  count_ = grid_.size();
  const std::uint32_t used = std::max(before, blocks() * kBlock);
  for (std::uint32_t place = count_; place < used; ++place) clear_place(place);
  // If find_contacts() would sort again in the next step, longer lists are for nothing.
  skin_ = fast.load() > count_ / kMostMoved ? 0 : usual_skin_;
}

// A block sleeps if all of its bodies have been quiet for long enough.
void Pile::settle_blocks() {
  sleeping_blocks_ = 0;
  for (std::uint32_t block = 0; block < blocks(); ++block) {
    const std::uint8_t* const states = state_.data() + std::size_t{block} * kBlock;
    std::uint32_t quiet = 0, touching = 0;
    for (std::uint32_t i = 0; i < kBlock; ++i) {
      quiet += static_cast<std::uint32_t>((states[i] & kQuietMask) == kQuietSteps);
      touching += static_cast<std::uint32_t>((states[i] & kTouching) != 0);
    }
    touching_[block] = static_cast<std::uint8_t>(touching);
    asleep_[block] = sleep_speed_ > 0 && quiet == kBlock ? 1 : 0;
    outside_[block] = loose_[block] = 0;
    if (asleep_[block] == 0) continue;
    ++sleeping_blocks_;
    for (std::uint32_t place = block * kBlock; place < (block + 1) * kBlock; ++place)
      records_[place].vx = records_[place].vy = records_[place].vz = 0;
  }
  list_awake();
}

// Completes moved_ to all places that are too far from their anchors, ascending.
void Pile::gather_loose() {
  for (const std::uint32_t block : awake_) {
    for (std::uint64_t bits = loose_[block]; bits != 0; bits &= bits - 1)
      moved_.push_back(block * kBlock + static_cast<std::uint32_t>(std::countr_zero(bits)));
    loose_[block] = 0;
  }
  std::sort(moved_.begin(), moved_.end());
  moved_.erase(std::unique(moved_.begin(), moved_.end()), moved_.end());
  std::erase_if(moved_, [this](std::uint32_t place) { return records_[place].slot == kNoSlot; });
}

void Pile::link(std::uint32_t place) {
  const float x = anchor_[0][place], y = anchor_[1][place], z = anchor_[2][place];
  strays_.add({x, y, z, records_[place].radius, place, grid_.cell_of(x, y, z), 0});
}

void Pile::unlink(std::uint32_t place) { strays_.remove(anchor_cell(place), place); }

void Pile::look_around(std::uint32_t cell, Scratch& scratch) const {
  Vicinity& out = scratch.vicinity;
  grid_.look_around(cell, scratch.rows, scratch.runs);
  kernels_->pack({anchor_[0].data(), anchor_[1].data(), anchor_[2].data(), anchor_radius_.data()},
                 {scratch.runs.runs.data(), scratch.runs.count}, out);
  if (adopted_ > 0) {
    for (const std::uint32_t near : grid_.around(cell)) {
      strays_.for_each(near, [&out](const Strays::Stray& stray) {
        if (out.count >= kMaxNeighbours + 400) return;
        out.x[out.count] = stray.x;
        out.y[out.count] = stray.y;
        out.z[out.count] = stray.z;
        out.radius[out.count] = stray.radius;
        out.place[out.count++] = stray.place;
      });
    }
  }
  const std::uint32_t whole = (out.count + kGroup - 1) / kGroup * kGroup;
  std::fill(&out.radius[out.count], &out.radius[out.count] + (whole - out.count), kNotFound);
  out.count = whole;
}

std::span<const std::uint32_t> Pile::find_near(const Seeker& seeker, Scratch& scratch) const {
  look_around(grid_.cell_of(seeker.x, seeker.y, seeker.z), scratch);
  const std::uint32_t count =
      kernels_->collect(scratch.vicinity, seeker, Vicinity::kMost, scratch.found.data());
  put_in_order({scratch.found.data(), count});
  return {scratch.found.data(), count};
}

// Gives the bodies of moved_ new anchors, and tells their neighbours. All have their anchors before the first
// looks around: so two of them that are near each other both find the other, and it does not matter who tells
// first.
void Pile::adopt_moved() {
  for (const std::uint32_t place : moved_) {
    if ((state_[place] & kAdopted) != 0) {
      unlink(place);
    } else {
      state_[place] |= kAdopted;
      anchor_radius_[place] = kNotFound;
      ++adopted_;
    }
    set_anchor(place);
    link(place);
  }
  constexpr std::uint32_t kAtOnce = 128;
  std::atomic<bool> any_marked = false;
  workers_->run(static_cast<std::uint32_t>(moved_.size()), kAtOnce,
                [&](std::uint32_t begin, std::uint32_t end) {
                  Scratch scratch;
                  bool marked = false;
                  for (std::uint32_t i = begin; i < end; ++i)
                    marked = introduce(moved_[i], scratch) || marked;
                  if (marked) any_marked = true;
                });
  any_marked_ = any_marked_ || any_marked.load();
  moved_.clear();
}

// Lists a body's partners, and the body with them. Returns whether it marked a block.
bool Pile::introduce(std::uint32_t place, Scratch& scratch) {
  const Record& self = records_[place];
  const auto partners = find_near(
      {anchor_[0][place], anchor_[1][place], anchor_[2][place], self.radius + skin_, place}, scratch);
  bool marked = false;
  for (const std::uint32_t other : partners) {
    {
      const GroupLock lock(locks_[other / kGroup]);
      insert(other, place);
    }
    if (asleep_[other / kBlock] == 0) continue;
    // It may have leant on the body that went.
    const Record& r = records_[other];
    const float dx = r.x - self.x, dy = r.y - self.y, dz = r.z - self.z;
    const float near = r.radius + self.radius + 0.5F * skin_;
    if (!(dx * dx + dy * dy + dz * dz < near * near)) continue;
    std::atomic_ref<std::uint8_t>(marked_[other / kBlock]).store(1, std::memory_order_relaxed);
    marked = true;
  }
  const GroupLock lock(locks_[place / kGroup]);
  set_list(place, partners);
  return marked;
}

void Pile::insert(std::uint32_t place, std::uint32_t partner) {
  const std::uint32_t group = place / kGroup;
  std::uint8_t& rows = rows_[group];
  if (rows == kUnlisted || rows == kSpilled) return;
  std::uint32_t* const column = entries_.get() + std::size_t{group} * kRows * kGroup + place % kGroup;
  std::uint32_t row = 0;
  while (row < rows && column[row * kGroup] < partner) ++row;
  if (row < rows && column[row * kGroup] == partner) return;
  // Ends of lists are filled with the place that is nowhere, which is the highest.
  std::uint32_t moving = partner;
  for (; row < rows && moving != most_places_; ++row) std::swap(moving, column[row * kGroup]);
  if (moving == most_places_) return;
  if (rows == kRows) {
    rows = kUnlisted;
    return;
  }
  std::uint32_t* const added = entries_.get() + (std::size_t{group} * kRows + rows) * kGroup;
  std::fill(added, added + kGroup, most_places_);
  added[place % kGroup] = moving;
  ++rows;
}

void Pile::set_list(std::uint32_t place, std::span<const std::uint32_t> partners) {
  const std::uint32_t group = place / kGroup;
  std::uint8_t& rows = rows_[group];
  if (rows == kUnlisted || rows == kSpilled) return;
  if (partners.size() > kRows) {
    rows = kUnlisted;
    return;
  }
  std::uint32_t* const first = entries_.get() + std::size_t{group} * kRows * kGroup;
  for (; rows < partners.size(); ++rows)
    std::fill(first + rows * kGroup, first + (rows + 1) * kGroup, most_places_);
  for (std::uint32_t row = 0; row < rows; ++row)
    first[row * kGroup + place % kGroup] = row < partners.size() ? partners[row] : most_places_;
}

// Lists of a group's bodies, ascending; returns the number of rows.
std::uint32_t Pile::make_lists(std::uint32_t group, Scratch& scratch) const {
  std::uint32_t rows = 0, around_cell = kNoCell;
  std::array<std::uint32_t, kGroup> counts{};
  for (std::uint32_t lane = 0; lane < kGroup; ++lane) {
    const std::uint32_t place = group * kGroup + lane;
    const Record& self = records_[place];
    std::uint32_t* const list = scratch.lanes[lane].data();
    std::uint32_t count = 0;
    // Bodies that a full cell turned away meet nobody.
    if (self.slot != kNoSlot && (!crowded_ || place < grid_.in_cells())) {
      const std::uint32_t cell = anchor_cell(place);
      if (cell != around_cell) look_around(cell, scratch);
      around_cell = cell;
      const Seeker seeker{anchor_[0][place], anchor_[1][place], anchor_[2][place], self.radius + skin_,
                          place};
      if (adopted_ > 0) {
        count = kernels_->collect(scratch.vicinity, seeker, Vicinity::kMost, scratch.found.data());
        put_in_order({scratch.found.data(), count});
        count = std::min(count, kScratchRows);
        std::copy(scratch.found.begin(), scratch.found.begin() + count, list);
      } else {
        count = std::min(kernels_->collect(scratch.vicinity, seeker, kScratchRows, list), kScratchRows);
      }
    }
    counts[lane] = count;
    rows = std::max(rows, count);
  }
  for (std::uint32_t lane = 0; lane < kGroup; ++lane) {
    std::uint32_t row = counts[lane];
    do {
      std::fill_n(scratch.lanes[lane].data() + row, kGroup, most_places_);
      row += kGroup;
    } while (row < rows);
  }
  // Loops of as many turns for each body are foreseen by the processor.
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t lane = 0; lane < kGroup; ++lane)
      scratch.entries[row * kGroup + lane] = scratch.lanes[lane][row];
  return rows;
}

}  // namespace tandem::engine
