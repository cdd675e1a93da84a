#pragma once
// The walk over the grid's bodies, for each way to look at a run of them.

#include <cstdint>

#include "sdk/core/predict/contact_pairs.hpp"

namespace tandem {

/// Bodies near `self` may be among `count` (1 to 8) from `from` on.
struct ContactRun {
  std::uint32_t self;
  std::uint32_t from : 28, count : 4;
};

/// A list of runs without branches that depend on the bodies; what is behind `count` is scratch.
class ContactRuns {
 public:
  static constexpr std::uint32_t kBodies = 32;  ///< whose runs fit, whatever the grid holds

  void clear() { count_ = 0; }
  [[nodiscard]] std::uint32_t size() const { return count_; }
  [[nodiscard]] const ContactRun& operator[](std::uint32_t i) const { return runs_[i]; }

  /// Bodies of at most three cells.
  void add(std::uint32_t self, std::uint32_t from, std::uint32_t to) {
    std::uint32_t left = to - from;
    for (; left > 2 * kWidth; from += kWidth, left -= kWidth) runs_[count_++] = {self, from, kWidth};
    runs_[count_] = {self, from, left < kWidth ? left : kWidth};
    runs_[count_ + 1] = {self, from + kWidth, left - kWidth};
    count_ += static_cast<std::uint32_t>(left > 0) + static_cast<std::uint32_t>(left > kWidth);
  }

  /// Of one body: its own cell and the 13 ahead.
  void add_body(const ContactGrid& grid, std::uint32_t place) {
    const std::uint32_t* const begin = grid.begin;
    const std::uint32_t side = grid.side_bits;
    const std::uint32_t mask = (1U << side) - 1;
    const std::uint32_t cell = grid.cell[place];
    const std::uint32_t x = cell & mask;
    const std::uint32_t y = (cell >> side) & mask;
    const std::uint32_t z = cell >> (2 * side);
    const std::uint32_t before = ((y - 1) & mask) << side;
    const std::uint32_t behind = ((y + 1) & mask) << side;
    const std::uint32_t above = ((z + 1) & mask) << (2 * side);
    const std::uint32_t rows[4] = {(z << (2 * side)) | behind, above | before, above | (y << side),
                                   above | behind};
    // Neighbours along x lie next to each other, but for the torus.
    if (x != 0 && x != mask) {
      add(place, place + 1, begin[cell + 2]);
      for (const std::uint32_t row : rows) add(place, begin[row + x - 1], begin[row + x + 2]);
      return;
    }
    const std::uint32_t two = x == 0 ? 0 : mask - 1;
    const std::uint32_t far = x == 0 ? mask : 0;
    add(place, place + 1, begin[cell + (x == 0 ? 2 : 1)]);
    if (x == mask) add(place, begin[cell - x], begin[cell - x + 1]);
    for (const std::uint32_t row : rows) {
      add(place, begin[row + two], begin[row + two + 2]);
      add(place, begin[row + far], begin[row + far + 1]);
    }
  }

 private:
  static constexpr std::uint32_t kWidth = 8;
  // A body has 14 cells in at most ten runs.
  static constexpr std::uint32_t kMostOfBody = 14 * ContactGrid::kMostInCell / kWidth + 10;

  std::uint32_t count_ = 0;
  ContactRun runs_[kBodies * kMostOfBody + 2];
};

/// ContactKernels::find. `collect(grid, runs, pairs)` adds the pairs of all runs.
template <class Collect>
inline std::uint32_t find_pairs(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough,
                                ContactPairs& pairs, const Collect& collect) {
  static_assert(ContactRuns::kBodies * 14 * ContactGrid::kMostInCell + 8 <= ContactPairs::kMostAtOnce);
  const std::uint32_t end = grid.begin[std::uint32_t{1} << (3 * grid.side_bits)];
  ContactRuns runs;
  pairs.count = 0;
  while (place < end && pairs.count < enough) {
    const std::uint32_t stop = end - place < ContactRuns::kBodies ? end : place + ContactRuns::kBodies;
    runs.clear();
    for (; place < stop; ++place) runs.add_body(grid, place);
    collect(grid, runs, pairs);
  }
  for (; pairs.count % 8 != 0; ++pairs.count) pairs.first[pairs.count] = pairs.second[pairs.count] = 0;
  return place;
}

}  // namespace tandem
