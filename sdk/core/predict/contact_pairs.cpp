#include "sdk/core/predict/contact_pairs.hpp"

#include "sdk/core/predict/contact_cells.hpp"
#include "sdk/core/predict/contact_law.hpp"

namespace tandem {
namespace {

std::uint32_t squared(std::uint32_t x) {
  const std::int32_t narrow = static_cast<std::int16_t>(x);
  return static_cast<std::uint32_t>(narrow * narrow);
}

std::uint32_t apart(std::uint32_t a_xy, std::uint32_t b_xy, std::uint32_t a_z, std::uint32_t b_z) {
  return squared(a_xy - b_xy) + squared((a_xy >> 16) - (b_xy >> 16)) + squared(a_z - b_z);
}

struct Portable {
  static void collect(const ContactGrid& grid, const ContactRuns<Portable>& runs, ContactPairs& pairs);
};

void Portable::collect(const ContactGrid& grid, const ContactRuns<Portable>& runs, ContactPairs& pairs) {
  std::uint32_t count = pairs.count;
  for (std::uint32_t r = 0; r < runs.size(); ++r) {
    const std::uint32_t self = runs[r].self();
    const std::uint32_t from = runs[r].from();
    for (std::uint32_t j = from; j < from + runs[r].count(); ++j) {
      bool near = apart(grid.xy[j], grid.xy[self], grid.z[j], grid.z[self]) < grid.near_squared;
      if (grid.later_xy != nullptr) {
        near |= apart(grid.later_xy[j], grid.later_xy[self], grid.z[j] >> 16, grid.z[self] >> 16) <
                grid.near_squared;
      }
      pairs.first[count] = self;
      pairs.second[count] = j;
      count += static_cast<std::uint32_t>(near);
    }
  }
  pairs.count = count;
}

std::int32_t difference(std::int16_t b, std::int16_t a) { return static_cast<std::int16_t>(b - a); }

void add_forces(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactView* views,
                const ContactPairs& pairs, ContactForce* forces) {
  for (std::uint32_t k = 0; k < pairs.count; ++k) {
    const ContactView& a = views[pairs.first[k]];
    const ContactView& b = views[pairs.second[k]];
    Vec3i d{};
    std::uint32_t squared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      d[i] = difference(b.q[i], a.q[i]);
      squared += static_cast<std::uint32_t>(d[i] * d[i]);
    }
    const std::int32_t reach = a.radius + b.radius;
    if (squared >= static_cast<std::uint32_t>(reach * reach)) continue;
    const std::uint32_t inverse = inverse_root[squared >> 16];
    // Half way to the middle of the table's entry: its slope is twice the root's.
    const std::uint32_t middle = (squared + ((squared & 0xFFFF0000U) | 0x8000U)) >> 1;
    const auto distance = static_cast<std::int32_t>((middle >> 12) * inverse >> 18);
    Vec3i n{0, squared == 0 ? 1 << 12 : 0, 0};
    Vec3i u{};
    for (std::size_t i = 0; i < 3; ++i) {
      n[i] += d[i] * static_cast<std::int32_t>(inverse) >> 18;
      u[i] = b.v[i] - a.v[i];
    }
    const Vec3i f = contact_force(law, std::max(0, reach - distance), n, u);
    for (std::size_t i = 0; i < 3; ++i) {
      forces[pairs.first[k]].f[i] += f[i];
      forces[pairs.second[k]].f[i] -= f[i];
    }
  }
}

}  // namespace

ContactKernels portable_contact_kernels() { return {find_pairs<Portable>, add_forces}; }

ContactKernels fastest_contact_kernels() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_contact_kernels();
#endif
  return portable_contact_kernels();
}

}  // namespace tandem
