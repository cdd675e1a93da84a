#pragma once
// One pass over the pairs of the tier `field`; included by each translation unit that has it for a processor.

#include "sdk/core/predict/field_lanes.hpp"
#include "sdk/core/predict/field_pairs.hpp"

namespace tandem {
namespace {

/// The bodies of a cell and of its 26 neighbours, side by side.
struct Around {
  static constexpr std::uint32_t kMost = 27 * FieldGrid::kMostInCell;

  alignas(32) std::int16_t p[3][kMost + 2 * kLanes];
  alignas(32) std::int16_t v[3][kMost + 2 * kLanes];
};

/// load(kFirst + kLanes - n): the first n lanes.
constexpr std::int16_t kFirst[2 * kLanes] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};

struct Pass {
  Lanes spring, shear, drag;
  int shear_shift;

  // Adds to `sum` what the bodies around, from `at` on, do to the one at p with v.
  template <bool kAll>
  inline void meet(const Around& around, std::uint32_t at, Lanes lanes, const Lanes (&p)[3],
                   const Lanes (&v)[3], Sums (&sum)[3]) const {
    Lanes d[3], u[3];
    for (unsigned i = 0; i < 3; ++i) {
      d[i] = p[i] - load(around.p[i] + at);
      d[i] = saturated_sum(d[i], d[i]);
      u[i] = saturated_difference(load(around.v[i] + at), v[i]);
    }
    const Lanes squared = saturated_sum(saturated_sum(high_product(d[0], d[0]), high_product(d[1], d[1])),
                                        high_product(d[2], d[2]));
    const Lanes x = all(4094) - squared;
    Lanes touching = x > all(0);
    if (!kAll) touching = touching & lanes;
    const Lanes x8 = x << 3;
    const Lanes xx = high_product(x8, x8);
    const Lanes curve = high_product(xx + xx, all(11469) + (x << 2));
    const Lanes twice = saturated_sum(curve, curve);
    const Lanes along = high_product(u[0], d[0]) + high_product(u[1], d[1]) + high_product(u[2], d[2]);
    const Lanes push =
        saturated_difference(high_product(saturated_sum(x8, saturated_sum(twice, twice)), spring),
                             high_product(along, shear) << shear_shift) &
        touching;
    const Lanes rub = drag & touching;
    for (unsigned i = 0; i < 3; ++i) sum[i] = sum[i] + product(push, d[i]) + product(u[i], rub);
  }

  // The bodies of a cell, at first .. last; `count`, at least one, are around.
  inline void cell(const Around& around, std::uint32_t count, std::uint32_t first, std::uint32_t last,
                   const FieldGrid& grid, std::int32_t* const (&f)[3]) const {
    const std::uint32_t end = (count - 1) / kLanes * kLanes;
    const Lanes lanes = load(kFirst + kLanes - (count - end));
    for (std::uint32_t place = first; place < last; ++place) {
      Lanes p[3], v[3];
      Sums sum[3] = {no_sums(), no_sums(), no_sums()};
      for (unsigned i = 0; i < 3; ++i) {
        p[i] = all(grid.p[i][place]);
        v[i] = all(grid.v[i][place]);
      }
      for (std::uint32_t at = 0; at < end; at += kLanes) meet<true>(around, at, lanes, p, v, sum);
      meet<false>(around, end, lanes, p, v, sum);
      for (unsigned i = 0; i < 3; ++i) f[i][place] = sum_of(sum[i]);
    }
  }
};

/// Fills an `Around`.
class Collector {
 public:
  Collector(const FieldGrid& grid, Around& around)
      : x_(grid.p[0]),
        y_(grid.p[1]),
        z_(grid.p[2]),
        u_(grid.v[0]),
        v_(grid.v[1]),
        w_(grid.v[2]),
        around_(around) {}

  inline void add(std::uint32_t from, std::uint32_t to) {
    std::uint32_t at = count_;
    count_ += to - from;
    do {
      store(around_.p[0] + at, load(x_ + from));
      store(around_.p[1] + at, load(y_ + from));
      store(around_.p[2] + at, load(z_ + from));
      store(around_.v[0] + at, load(u_ + from));
      store(around_.v[1] + at, load(v_ + from));
      store(around_.v[2] + at, load(w_ + from));
      at += kLanes;
      from += kLanes;
    } while (at < count_);
  }
  inline std::uint32_t take() {
    const std::uint32_t count = count_;
    count_ = 0;
    return count;
  }

 private:
  const std::int16_t *x_, *y_, *z_, *u_, *v_, *w_;
  Around& around_;
  std::uint32_t count_ = 0;
};

inline void set_forces(const FieldLaw& law, const FieldGrid& grid, std::int32_t* const (&f)[3]) {
  const Pass pass{all(law.spring), all(law.shear), all(law.drag), law.shear_shift};
  Around around{};
  Collector collector(grid, around);
  const std::uint32_t side = 1U << grid.side_bits;
  const std::uint32_t mask = side - 1;
  for (std::uint32_t row = 0; row < side * side; ++row) {
    const std::uint32_t* const own = grid.begin + std::size_t{row} * side;
    if (own[0] == own[side]) continue;
    const std::uint32_t y = row & mask;
    const std::uint32_t z = row >> grid.side_bits;
    const std::uint32_t* rows[9];
    for (std::uint32_t k = 0; k < 9; ++k) {
      const std::uint32_t other = (((z + k / 3 - 1) & mask) << grid.side_bits) | ((y + k % 3 - 1) & mask);
      rows[k] = grid.begin + std::size_t{other} * side;
    }
    for (std::uint32_t x = 0; x < side; ++x) {
      if (own[x] == own[x + 1]) continue;
      // Neighbours along x lie next to each other, but for the torus.
      if (x != 0 && x != mask) {
        for (const std::uint32_t* const begin : rows) collector.add(begin[x - 1], begin[x + 2]);
      } else {
        const std::uint32_t low = x == 0 ? 0 : mask - 1;
        const std::uint32_t far = x == 0 ? mask : 0;
        for (const std::uint32_t* const begin : rows) {
          collector.add(begin[low], begin[low + 2]);
          collector.add(begin[far], begin[far + 1]);
        }
      }
      pass.cell(around, collector.take(), own[x], own[x + 1], grid, f);
    }
  }
}

}  // namespace
}  // namespace tandem
