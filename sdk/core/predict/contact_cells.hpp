#pragma once
// The walk over the grid's cells, for each way to look at a run of bodies.

#include <cstdint>

#include "sdk/core/predict/contact_pairs.hpp"

namespace tandem {

/// ContactKernels::find. `collect(grid, place, from, to, first, second, count)` writes the pairs of `place`
/// with [from, to), which may be empty and holds at most three cells, and returns the new count.
template <class Collect>
inline std::uint32_t find_pairs(const ContactGrid& all, std::uint32_t place, ContactPairs& pairs,
                                Collect collect) {
  const ContactGrid grid = all;
  std::uint32_t* const first = pairs.first;
  std::uint32_t* const second = pairs.second;
  std::uint32_t count = pairs.count;
  const std::uint32_t side = grid.side_bits;
  const std::uint32_t mask = (1U << side) - 1;
  const std::uint32_t* const begin = grid.begin;
  const std::uint32_t end = begin[std::uint32_t{1} << (3 * side)];
  while (place < end && pairs.room - count >= ContactPairs::kMostOfCell) {
    const std::uint32_t cell = grid.cell[place];
    const std::uint32_t from = place;
    place = begin[cell + 1];
    const auto look_at = [&](std::uint32_t low, std::uint32_t high) {
      for (std::uint32_t self = from; self < place; ++self)
        count = collect(grid, self, low, high, first, second, count);
    };
    const std::uint32_t x = cell & mask;
    const std::uint32_t y = (cell >> side) & mask;
    const std::uint32_t z = cell >> (2 * side);
    const std::uint32_t above = z << (2 * side);
    const std::uint32_t next = ((z + 1) & mask) << (2 * side);
    const std::uint32_t rows[4] = {above | (((y + 1) & mask) << side), next | (((y - 1) & mask) << side),
                                   next | (y << side), next | (((y + 1) & mask) << side)};
    // Neighbours along x lie next to each other, but for the torus.
    std::uint32_t own_end = place;
    if (x != 0 && x != mask) {
      for (const std::uint32_t row : rows) look_at(begin[row + x - 1], begin[row + x + 2]);
      own_end = begin[cell + 2];
    } else {
      const std::uint32_t pair = x == 0 ? 0 : mask - 1;
      const std::uint32_t far = x == 0 ? mask : 0;
      for (const std::uint32_t row : rows) {
        look_at(begin[row + pair], begin[row + pair + 2]);
        look_at(begin[row + far], begin[row + far + 1]);
      }
      if (x == 0) own_end = begin[cell + 2];
      if (x == mask) look_at(begin[cell - x], begin[cell - x + 1]);
    }
    for (std::uint32_t self = from; self < place; ++self)
      count = collect(grid, self, self + 1, own_end, first, second, count);
  }
  pairs.count = count;
  return place;
}

}  // namespace tandem
