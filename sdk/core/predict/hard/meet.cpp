#include "sdk/core/predict/hard/meet.hpp"

#include <algorithm>
#include <array>

#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

using L = HardLaw;

Vec3i difference(const Vec3i& a, const Vec3i& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

// The sum of the magnitudes of u in lattice units: bodies do not come nearer by more in a frame.
std::int64_t way_in_a_frame(const Vec3i& u) {
  std::int64_t sum = 0;
  for (const std::int64_t x : u) sum += x < 0 ? -x : x;
  return sum >> 6;
}

// The contact of two bodies; false if there is none.
bool meet_one(const HardReach& reach, const ContactBody& a, const ContactBody& b, HardContact& contact) {
  std::array<std::int64_t, 3> d{};
  std::uint64_t squared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = std::int64_t{a.p[i]} - b.p[i];
    squared += static_cast<std::uint64_t>(d[i] * d[i]);
  }
  const Vec3i u = difference(a.v, b.v);
  const std::int64_t radii = std::int64_t{a.radius} + b.radius;
  const std::int64_t most = radii + reach.reach + way_in_a_frame(u);
  if (squared >= static_cast<std::uint64_t>(most * most)) return false;
  const std::int64_t far = squared == 0 ? 0 : static_cast<std::int64_t>(quick_root(squared));
  const std::int64_t inverse = far == 0 ? 0 : (std::int64_t{1} << 40) / far;
  Vec3i n{};
  for (std::size_t i = 0; i < 3; ++i) n[i] = static_cast<std::int32_t>((d[i] * inverse + (1 << 27)) >> 28);
  if (far == 0) n[1] = L::kOne;
  return hard_touches(reach, far - radii, n, u, contact);
}

std::uint32_t meet(const HardReach& reach, const HardBodies& of, const ContactPairs& pairs,
                   HardContact* found) {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < pairs.count; ++i) {
    const std::uint32_t a = pairs.first[i];
    const std::uint32_t b = pairs.second[i];
    // It is written where it is to stay, because to copy what was written just now is slow.
    HardContact& contact = found[count];
    if ((of.mobility[a] | of.mobility[b]) == 0 || !meet_one(reach, of.bodies[a], of.bodies[b], contact))
      continue;
    contact.a = a;
    contact.b = b;
    ++count;
  }
  return count;
}

}  // namespace

bool hard_touches(const HardReach& reach, std::int64_t gap, const Vec3i& n, const Vec3i& u,
                  HardContact& contact) {
  std::int64_t speed = 0;
  for (std::size_t i = 0; i < 3; ++i) speed += std::int64_t{u[i]} * n[i];
  const std::int64_t later = gap * 64 + std::min<std::int64_t>(0, speed >> 12);
  if (later >= std::int64_t{reach.reach} * 64) return false;
  contact.n = n;
  contact.gap = limited(gap * 64 >> reach.shift, L::kMaxWord);
  contact.run = later > reach.met ? 1 : 0;
  return true;
}

HardMeet portable_hard_meet() { return meet; }

HardMeet fastest_hard_meet() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_hard_meet();
#endif
  return portable_hard_meet();
}

}  // namespace tandem
