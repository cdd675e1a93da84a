#pragma once
// One pass over the pairs of the tier `field`; included by each translation unit that has it for a processor.

#include "sdk/core/predict/field_lanes.hpp"
#include "sdk/core/predict/field_pairs.hpp"

namespace tandem {
namespace {

/// The bodies of a cell and of the cells ahead of it, side by side. What follows the last one is far away.
struct Around {
  static constexpr std::uint32_t kMost = 14 * FieldGrid::kMostInCell;

  std::int16_t p[3][kMost + 2 * kLanes];
  std::int16_t v[3][kMost + 2 * kLanes];
  std::int16_t f[3][kMost + 2 * kLanes];
};

/// Lanes above the `kLanes - 1`th from the front on: load(kAfter + kLanes - 1 - k) are those behind lane k.
alignas(32) constexpr std::int16_t kAfter[2 * kLanes] = {0,  0,  0,  0,  0,  0,  0,  0,  0,  0,  0,
                                                         0,  0,  0,  0,  0,  -1, -1, -1, -1, -1, -1,
                                                         -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
/// load(kBefore + kLanes - n) are the first n.
alignas(32) constexpr std::int16_t kBefore[2 * kLanes] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1,
                                                          -1, -1, -1, -1, -1, 0,  0,  0,  0,  0,  0,
                                                          0,  0,  0,  0,  0,  0,  0,  0,  0,  0};

struct Run {
  std::uint32_t from, to;
};

struct Pass {
  Lanes spring, shear, drag;
  int shear_shift;

  // Body k of the cell with lanes at..; `mask` leaves lanes out.
  template <bool kMasked>
  inline void meet(Around& around, std::uint32_t at, const Lanes (&p)[3], const Lanes (&v)[3],
                   Lanes (&own)[3], Lanes mask) const {
    Lanes d[3], u[3];
    for (unsigned i = 0; i < 3; ++i) {
      d[i] = p[i] - load(around.p[i] + at);
      d[i] = saturated_sum(d[i], d[i]);
      u[i] = saturated_difference(load(around.v[i] + at), v[i]);
    }
    const Lanes squared = saturated_sum(saturated_sum(high_product(d[0], d[0]), high_product(d[1], d[1])),
                                        high_product(d[2], d[2]));
    const Lanes x = all(4095) - squared;
    Lanes touching = x > all(0);
    if (kMasked) touching = touching & mask;
    const Lanes x8 = x << 3;
    const Lanes xx = high_product(x8, x8);
    const Lanes along = high_product(u[0], d[0]) + high_product(u[1], d[1]) + high_product(u[2], d[2]);
    const Lanes push = saturated_difference(high_product(saturated_sum(x8, xx + xx), spring),
                                            high_product(along, shear) << shear_shift) &
                       touching;
    const Lanes rub = drag & touching;
    for (unsigned i = 0; i < 3; ++i) {
      const Lanes force = high_product(push, d[i]) + high_product(u[i], rub) - touching;
      own[i] = own[i] + force;
      store(around.f[i] + at, load(around.f[i] + at) - force);
    }
  }

  inline void cell(Around& around, const Run* runs, std::uint32_t run_count, std::uint32_t in_cell,
                   const FieldGrid& grid, std::int16_t* const (&f)[3]) const {
    std::uint32_t count = 0;
    for (std::uint32_t r = 0; r < run_count; ++r) {
      for (std::uint32_t j = runs[r].from; j < runs[r].to; j += kLanes) {
        const std::uint32_t at = count + j - runs[r].from;
        for (unsigned i = 0; i < 3; ++i) {
          store(around.p[i] + at, load(grid.p[i] + j));
          store(around.v[i] + at, load(grid.v[i] + j));
        }
      }
      count += runs[r].to - runs[r].from;
    }
    // Half way round from the cell.
    store(around.p[0] + count, all(static_cast<std::int16_t>(around.p[0][0] ^ INT16_MIN)));
    const Lanes none = all(0);
    for (std::uint32_t at = 0; at < count; at += kLanes)
      for (unsigned i = 0; i < 3; ++i) store(around.f[i] + at, none);
    for (std::uint32_t k = 0; k < in_cell; ++k) {
      Lanes p[3], v[3];
      Lanes own[3] = {none, none, none};
      for (unsigned i = 0; i < 3; ++i) {
        p[i] = all(around.p[i][k]);
        v[i] = all(around.v[i][k]);
      }
      meet<true>(around, 0, p, v, own, load(kAfter + kLanes - 1 - k));
      for (std::uint32_t at = kLanes; at < count; at += kLanes) meet<false>(around, at, p, v, own, none);
      for (unsigned i = 0; i < 3; ++i)
        around.f[i][k] = static_cast<std::int16_t>(around.f[i][k] + sum_of(own[i]));
    }
    count = 0;
    for (std::uint32_t r = 0; r < run_count; ++r) {
      for (std::uint32_t j = runs[r].from; j < runs[r].to; j += kLanes) {
        const std::uint32_t at = count + j - runs[r].from;
        const std::uint32_t left = runs[r].to - j;
        const Lanes mask = load(kBefore + (left < kLanes ? kLanes - left : 0));
        for (unsigned i = 0; i < 3; ++i) store(f[i] + j, load(f[i] + j) + (load(around.f[i] + at) & mask));
      }
      count += runs[r].to - runs[r].from;
    }
  }
};

inline void add_forces(const FieldLaw& law, const FieldGrid& grid, std::int16_t* const (&f)[3]) {
  const Pass pass{all(law.spring), all(law.shear), all(law.drag), law.shear_shift};
  Around around{};
  const std::uint32_t side = grid.side_bits;
  const std::uint32_t mask = (1U << side) - 1;
  const std::uint32_t cells = 1U << (3 * side);
  const std::uint32_t* const begin = grid.begin;
  Run runs[10];
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const std::uint32_t last = begin[cell + 1];
    if (begin[cell] == last) continue;
    const std::uint32_t x = cell & mask;
    const std::uint32_t y = (cell >> side) & mask;
    const std::uint32_t z = cell >> (2 * side);
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
    add(begin[cell], x == mask ? last : begin[cell + 2]);
    if (x == mask) add(begin[cell - x], begin[cell - x + 1]);
    const std::uint32_t above = z << (2 * side);
    const std::uint32_t next = ((z + 1) & mask) << (2 * side);
    add_row(above | (((y + 1) & mask) << side));
    add_row(next | (((y - 1) & mask) << side));
    add_row(next | (y << side));
    add_row(next | (((y + 1) & mask) << side));
    pass.cell(around, runs, count, last - begin[cell], grid, f);
  }
}

}  // namespace
}  // namespace tandem
