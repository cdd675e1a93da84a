#include "sdk/core/predict/field_pairs.hpp"

#include "sdk/core/predict/lanes16.hpp"

namespace tandem {
namespace {

using Lanes3 = std::array<Lanes16, 3>;

// For a run's last vector: lanes beyond its end are none of it.
constexpr std::int16_t kNone[16] = {-1, -1, -1, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 0, 0, 0};

struct Pass {
  Lanes16 spring, shear, drag;
  int shear_shift;
  std::array<const std::int16_t*, 3> p, v;
  std::array<std::int16_t*, 3> f;

  // Body p, v with those at [from, to), whose changes of v are subtracted there and summed in `own`.
  inline void meet(const Lanes3& self_p, const Lanes3& self_v, std::uint32_t from, std::uint32_t to,
                   Lanes3& own) const {
    for (std::uint32_t j = from; j < to; j += kLanes16) {
      Lanes3 d, u;
      for (std::size_t i = 0; i < 3; ++i) {
        d[i] = self_p[i] - load_lanes(p[i] + j);
        d[i] = saturated_sum(d[i], d[i]);
        u[i] = saturated_difference(load_lanes(v[i] + j), self_v[i]);
      }
      const Lanes16 squared = saturated_sum(saturated_sum(high_product(d[0], d[0]), high_product(d[1], d[1])),
                                            high_product(d[2], d[2]));
      const Lanes16 x = all_lanes(4095) - squared;
      const Lanes16 touching =
          (x > all_lanes(0)) & load_lanes(kNone + (to - j < kLanes16 ? kLanes16 - (to - j) : 0));
      const Lanes16 x8 = x << 3;
      const Lanes16 xx = high_product(x8, x8);
      const Lanes16 along = high_product(u[0], d[0]) + high_product(u[1], d[1]) + high_product(u[2], d[2]);
      const Lanes16 push = saturated_difference(high_product(saturated_sum(x8, xx + xx), spring),
                                                high_product(along, shear) << shear_shift) &
                           touching;
      const Lanes16 rub = drag & touching;
      for (std::size_t i = 0; i < 3; ++i) {
        const Lanes16 force = high_product(push, d[i]) + high_product(u[i], rub) - touching;
        own[i] += force;
        store_lanes(f[i] + j, load_lanes(f[i] + j) - force);
      }
    }
  }
};

}  // namespace

void add_field_forces(const FieldLaw& law, const FieldGrid& grid, const std::array<std::int16_t*, 3>& f) {
  const Pass pass{
      all_lanes(law.spring), all_lanes(law.shear), all_lanes(law.drag), law.shear_shift, grid.p, grid.v, f};
  const std::uint32_t side = grid.side_bits;
  const std::uint32_t mask = (1U << side) - 1;
  const std::uint32_t cells = 1U << (3 * side);
  const std::uint32_t* const begin = grid.begin;
  struct Run {
    std::uint32_t from, to;
  };
  std::array<Run, 10> runs{};
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
    const std::uint32_t above = z << (2 * side);
    const std::uint32_t next = ((z + 1) & mask) << (2 * side);
    add_row(above | (((y + 1) & mask) << side));
    add_row(next | (((y - 1) & mask) << side));
    add_row(next | (y << side));
    add_row(next | (((y + 1) & mask) << side));
    if (x == mask) add(begin[cell - x], begin[cell - x + 1]);
    const std::uint32_t own_end = x == mask ? last : begin[cell + 2];
    for (std::uint32_t place = begin[cell]; place < last; ++place) {
      Lanes3 p, v;
      Lanes3 own{};
      for (std::size_t i = 0; i < 3; ++i) {
        p[i] = all_lanes(grid.p[i][place]);
        v[i] = all_lanes(grid.v[i][place]);
      }
      pass.meet(p, v, place + 1, own_end, own);
      for (std::uint32_t r = 0; r < count; ++r) pass.meet(p, v, runs[r].from, runs[r].to, own);
      for (std::size_t i = 0; i < 3; ++i)
        f[i][place] = static_cast<std::int16_t>(f[i][place] + sum_of(own[i]));
    }
  }
}

}  // namespace tandem
