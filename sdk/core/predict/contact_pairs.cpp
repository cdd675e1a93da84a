#include "sdk/core/predict/contact_pairs.hpp"

#include "sdk/core/predict/contact_cells.hpp"
#include "sdk/core/predict/contact_law.hpp"

namespace tandem {
namespace {

std::int32_t apart(std::uint32_t a, std::uint32_t b) { return static_cast<std::int16_t>(a - b); }

void collect(const ContactGrid& grid, const ContactRuns& runs, ContactPairs& pairs) {
  std::uint32_t count = pairs.count;
  for (std::uint32_t r = 0; r < runs.size(); ++r) {
    const ContactRun run = runs[r];
    for (std::uint32_t j = run.from; j < run.from + run.count; ++j) {
      const std::int32_t x = apart(grid.xy[j], grid.xy[run.self]);
      const std::int32_t y = apart(grid.xy[j] >> 16, grid.xy[run.self] >> 16);
      const std::int32_t z = apart(grid.z[j], grid.z[run.self]);
      const std::uint32_t squared = static_cast<std::uint32_t>(x * x) + static_cast<std::uint32_t>(y * y) +
                                    static_cast<std::uint32_t>(z * z);
      pairs.first[count] = run.self;
      pairs.second[count] = j;
      count += static_cast<std::uint32_t>(squared < grid.near_squared);
    }
  }
  pairs.count = count;
}

std::uint32_t find(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough, ContactPairs& pairs) {
  return find_pairs(grid, place, enough, pairs, collect);
}

// b - a of what may be 2^31 apart; bodies that far apart do not touch, whatever the sign.
std::int32_t difference(std::int32_t b, std::int32_t a) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(b) - static_cast<std::uint32_t>(a));
}

void add_forces(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactBody* bodies,
                const ContactPairs& pairs, ContactForce* forces) {
  for (std::uint32_t k = 0; k < pairs.count; ++k) {
    const ContactBody& a = bodies[pairs.first[k]];
    const ContactBody& b = bodies[pairs.second[k]];
    Vec3i d{};
    std::int32_t squared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      d[i] = std::clamp(difference(b.p[i], a.p[i]) >> law.shift, -kFarthest, kFarthest);
      squared += d[i] * d[i];
    }
    const std::int32_t reach = (a.radius + b.radius) >> law.shift;
    if (squared >= reach * reach) continue;
    const std::uint32_t inverse = inverse_root[squared >> 16];
    const auto distance =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(squared >> 12) * inverse >> 18);
    Vec3i n{0, squared == 0 ? 1 << 12 : 0, 0};
    Vec3i u{};
    for (std::size_t i = 0; i < 3; ++i) {
      n[i] += d[i] * static_cast<std::int32_t>(inverse) >> 18;
      u[i] = contact_speed(law, difference(b.v[i], a.v[i]));
    }
    const Vec3i f = contact_force(law, std::max(0, reach - distance), n, u);
    for (std::size_t i = 0; i < 3; ++i) {
      forces[pairs.first[k]].f[i] += f[i];
      forces[pairs.second[k]].f[i] -= f[i];
    }
  }
}

}  // namespace

ContactKernels portable_contact_kernels() { return {find, add_forces}; }

ContactKernels fastest_contact_kernels() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_contact_kernels();
#endif
  return portable_contact_kernels();
}

}  // namespace tandem
