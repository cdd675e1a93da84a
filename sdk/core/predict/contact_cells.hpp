#pragma once
// The walk over the grid's cells, for each way to look at a run of bodies.

#include <cstdint>

#include "sdk/core/predict/contact_pairs.hpp"

namespace tandem {

/// ContactKernels::find. `collect(grid, place, from, to, pairs)` adds the pairs of `place` with [from, to).
template <class Collect>
inline std::uint32_t find_pairs(const ContactGrid& grid, std::uint32_t cell, ContactPairs& pairs,
                                Collect collect) {
  const std::uint32_t side = grid.side_bits;
  const std::uint32_t mask = (1U << side) - 1;
  const std::uint32_t cells = 1U << (3 * side);
  const std::uint32_t* const begin = grid.begin;
  struct Run {
    std::uint32_t from, to;
  };
  Run runs[9];
  for (; cell < cells; ++cell) {
    const std::uint32_t last = begin[cell + 1];
    if (begin[cell] == last) continue;
    if (pairs.room - pairs.count < ContactPairs::kMostOfCell) break;
    const std::uint32_t x = cell & mask;
    const std::uint32_t y = (cell >> side) & mask;
    const std::uint32_t z = cell >> (2 * side);
    const std::uint32_t own = cell - x;
    std::uint32_t count = 0;
    const auto add = [&](std::uint32_t from, std::uint32_t to) {
      runs[count] = {from, to};
      count += static_cast<std::uint32_t>(from != to);
    };
    // Neighbours along x lie next to each other, but for the torus.
    const bool inner = x != 0 && x != mask;
    const auto add_row = [&](std::uint32_t row) {
      if (inner) return add(begin[row + x - 1], begin[row + x + 2]);
      const std::uint32_t low = x == 0 ? 0 : mask - 1;
      const std::uint32_t far = x == 0 ? mask : 0;
      add(begin[row + low], begin[row + low + 2]);
      add(begin[row + far], begin[row + far + 1]);
    };
    const std::uint32_t above = z << (2 * side);
    const std::uint32_t next = ((z + 1) & mask) << (2 * side);
    add_row(above | (((y + 1) & mask) << side));
    add_row(next | (((y - 1) & mask) << side));
    add_row(next | (y << side));
    add_row(next | (((y + 1) & mask) << side));
    if (x == mask) add(begin[own], begin[own + 1]);
    const std::uint32_t own_end = x == mask ? last : begin[cell + 2];
    for (std::uint32_t place = begin[cell]; place < last; ++place) {
      if (place + 1 < own_end) collect(grid, place, place + 1, own_end, pairs);
      for (std::uint32_t r = 0; r < count; ++r) collect(grid, place, runs[r].from, runs[r].to, pairs);
    }
  }
  return cell;
}

}  // namespace tandem
