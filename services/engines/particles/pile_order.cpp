// Places, anchors and lists.
#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <thread>

#include "services/engines/particles/pile.hpp"

namespace tandem::engine {
namespace {

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
  moved_.clear();
  strange_.clear();
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
  skin_ = fast.load() > count_ / kMaxMoved ? 0 : usual_skin_;
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
  strange_ = moved_;
  for (const std::uint32_t block : awake_) {
    for (std::uint64_t bits = loose_[block]; bits != 0; bits &= bits - 1) {
      const std::uint32_t place = block * kBlock + static_cast<std::uint32_t>(std::countr_zero(bits));
      if (records_[place].slot != kNoSlot) moved_.push_back(place);
    }
    loose_[block] = 0;
  }
  if (strange_.empty()) return;  // they ascend
  std::sort(strange_.begin(), strange_.end());
  std::sort(moved_.begin(), moved_.end());
  moved_.erase(std::unique(moved_.begin(), moved_.end()), moved_.end());
  std::erase_if(moved_, [this](std::uint32_t place) { return records_[place].slot == kNoSlot; });
}

Strays::Stray Pile::stray(std::uint32_t place) const {
  return {anchor_[0][place], anchor_[1][place], anchor_[2][place], records_[place].radius, place,
          anchor_cell(place)};
}

void Pile::look_around(std::uint32_t cell, Rows& rows, Look& out) const {
  grid_.look_around(cell, rows, out.sorted);
  out.strays.count = 0;
  if (strays_.size() > 0) strays_.look_around(rows, grid_.across(cell), out.strays);
}

void Pile::fetch(std::uint32_t place, const Look& look) const {
  const auto fetch_runs = [](const Anchors& anchors, std::span<const Run> runs) {
    for (const Run& run : runs) {
      if (run.begin == run.end) continue;
      for (const float* const column : {anchors.x, anchors.y, anchors.z, anchors.radius}) {
        __builtin_prefetch(column + run.begin);
        __builtin_prefetch(column + run.end - 1);
      }
    }
  };
  fetch_runs(anchors(), {look.sorted.runs.data(), look.sorted.count});
  fetch_runs(strays_.anchors(), {look.strays.runs.data(), look.strays.count});
  const std::uint32_t group = place / kGroup;
  for (std::uint32_t row = 0; row < kRows && row < rows_[group]; ++row)
    __builtin_prefetch(&entries_[(std::size_t{group} * kRows + row) * kGroup], 1);
}

std::uint32_t Pile::add_strays(const Seeker& seeker, const Look& look, std::uint32_t most,
                               std::uint32_t* places, std::uint32_t count) const {
  count = std::min(count, most);
  if (look.strays.count == 0) return count;
  constexpr std::uint32_t kMaxStrays = 400;
  std::array<std::uint32_t, kMaxStrays + 2 * kGroup> found;
  const std::uint32_t strays =
      std::min(kMaxStrays, kernels_->collect(strays_.anchors(), {look.strays.runs.data(), look.strays.count},
                                             seeker, kMaxStrays, found.data()));
  for (std::uint32_t i = 0; i < strays && count < most; ++i) places[count++] = found[i];
  put_in_order({places, count});
  return count;
}

std::span<const std::uint32_t> Pile::find_near(const Seeker& seeker, const Look& look,
                                               Scratch& scratch) const {
  std::uint32_t* const found = scratch.found.data();
  const std::uint32_t sorted =
      kernels_->collect(anchors(), {look.sorted.runs.data(), look.sorted.count}, seeker, kMaxFound, found);
  return {found, add_strays(seeker, look, kMaxFound, found, sorted)};
}

// Gives the bodies of moved_ new anchors, and tells their neighbours. All have their anchors before the first
// looks around: so two of them that are near each other both find the other, and it does not matter who tells
// first.
void Pile::adopt_moved() {
  if (moved_.empty()) return;
  left_.resize(moved_.size());
  for (const std::uint32_t place : moved_) {
    if ((state_[place] & kAdopted) != 0) continue;
    state_[place] |= kAdopted;
    to_[place] = strays_.add({});
  }
  constexpr std::uint32_t kAtOnce = 128;
  const auto moved = static_cast<std::uint32_t>(moved_.size());
  workers_->run(moved, kAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t place = moved_[i];
      const bool is_strange = std::binary_search(strange_.begin(), strange_.end(), place);
      left_[i] = is_strange ? Vec3f{kNowhere, kNowhere, kNowhere}
                            : Vec3f{anchor_[0][place], anchor_[1][place], anchor_[2][place]};
      set_anchor(place);
      anchor_radius_[place] = kNotFound;
      strays_[to_[place]] = stray(place);
    }
  });
  strays_.arrange();
  std::atomic<bool> any_marked = false;
  workers_->run(moved, kAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    Scratch scratch;
    bool marked = false;
    const auto prepare = [&](std::uint32_t i) {
      Look& look = scratch.looks[i % 2];
      look_around(anchor_cell(moved_[i]), scratch.rows, look);
      fetch(moved_[i], look);
    };
    prepare(begin);
    for (std::uint32_t i = begin; i < end; ++i) {
      if (i + 1 < end) prepare(i + 1);
      marked = introduce(moved_[i], left_[i], scratch.looks[i % 2], scratch) || marked;
    }
    if (marked) any_marked = true;
  });
  any_marked_ = any_marked_ || any_marked.load();
  moved_.clear();
  strange_.clear();
}

// Lists a body's partners, and the body with them, except with those that list it already: that were near to
// it when its anchor was at `from`. Returns whether it marked a block.
bool Pile::introduce(std::uint32_t place, const Vec3f& from, const Look& look, Scratch& scratch) {
  constexpr float kSurely = 0.999F;  // in spite of rounding
  const Record& self = records_[place];
  const auto partners = find_near(seeker(place), look, scratch);
  bool marked = false;
  for (const std::uint32_t other : partners) {
    const Record& r = records_[other];
    const float fx = anchor_[0][other] - from[0], fy = anchor_[1][other] - from[1],
                fz = anchor_[2][other] - from[2];
    const float known = kSurely * (r.radius + self.radius + skin_);
    if (!(fx * fx + fy * fy + fz * fz < known * known)) {
      const GroupLock lock(locks_[other / kGroup]);
      insert(other, place);
    }
    if (asleep_[other / kBlock] == 0) continue;
    // It may have leant on the body that went.
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

// Lists of a group's bodies, ascending, into scratch.lanes; returns the number of rows.
std::uint32_t Pile::make_lists(std::uint32_t group, Scratch& scratch) const {
  // Neighbours in place mostly share their cell, and what is around it.
  std::array<std::uint32_t, kGroup> cells;
  for (std::uint32_t lane = 0; lane < kGroup; ++lane) {
    const std::uint32_t place = group * kGroup + lane;
    // Bodies that a full cell turned away meet nobody.
    const bool meets = records_[place].slot != kNoSlot && (!crowded_ || place < grid_.in_cells());
    cells[lane] = meets ? anchor_cell(place) : kNoCell;
  }
  const auto end_of = [&cells](std::uint32_t lane) {
    std::uint32_t end = lane;
    while (end < kGroup && cells[end] == cells[lane]) ++end;
    return end;
  };
  const auto pack = [&](std::uint32_t lane, Vicinity& out) {
    if (lane == kGroup || cells[lane] == kNoCell) return;
    Neighbourhood& runs = scratch.looks.front().sorted;
    grid_.look_around(cells[lane], scratch.rows, runs);
    kernels_->pack(anchors(), {runs.runs.data(), runs.count}, out);
  };
  std::array<std::uint32_t, kGroup> counts{};
  pack(0, scratch.vicinities[0]);
  for (std::uint32_t lane = 0, turn = 0; lane < kGroup; ++turn) {
    const std::uint32_t end = end_of(lane);
    const Vicinity& around = scratch.vicinities[turn % 2];
    pack(end, scratch.vicinities[(turn + 1) % 2]);
    for (; lane < end; ++lane) {
      if (cells[lane] == kNoCell) continue;
      counts[lane] =
          std::min(kScratchRows, kernels_->collect_packed(around, seeker(group * kGroup + lane), kScratchRows,
                                                          scratch.lanes[lane].data()));
    }
  }
  for (std::uint32_t lane = 0; lane < kGroup && strays_.size() > 0; ++lane) {
    if (cells[lane] == kNoCell) continue;
    Look& look = scratch.looks.front();
    look_around(cells[lane], scratch.rows, look);
    counts[lane] = add_strays(seeker(group * kGroup + lane), look, kScratchRows, scratch.lanes[lane].data(),
                              counts[lane]);
  }
  const std::uint32_t rows = *std::max_element(counts.begin(), counts.end());
  for (std::uint32_t lane = 0; lane < kGroup; ++lane) {
    std::uint32_t row = counts[lane];
    do {
      std::fill_n(scratch.lanes[lane].data() + row, kGroup, most_places_);
      row += kGroup;
    } while (row < rows);
  }
  return rows;
}

void Pile::weave(const Scratch& scratch, std::uint32_t rows, std::uint32_t* entries) {
  // Loops of as many turns for each body are foreseen by the processor.
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t lane = 0; lane < kGroup; ++lane)
      entries[row * kGroup + lane] = scratch.lanes[lane][row];
}

}  // namespace tandem::engine
