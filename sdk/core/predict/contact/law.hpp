#pragma once
// The force of one contact, as idl/PROTOCOL.md has it.

#include <algorithm>
#include <cstdint>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

inline constexpr std::int32_t kMostSpeed = (1 << 14) - 1;  ///< of a body, in grid units per frame
inline constexpr std::int32_t kMostPush = (1 << 15) - 1;   ///< 1/8 grid unit
inline constexpr std::int32_t kMostOverlap = 1 << 14;      ///< grid units

/// A velocity, in 1/64 lattice unit, as the law has it.
[[nodiscard]] inline std::int32_t contact_speed(const ContactLaw& law, std::int32_t v) {
  return std::clamp(v >> (law.shift + 6), -kMostSpeed, kMostSpeed);
}

/// With `n` in 2^-12 towards the other, `u` the other's velocity less the own. |u| < 2^15 on each axis,
/// |n| < 2^12.5, spring <= 2^16, shear <= 2^13, drag <= 2^14: all of it fits 32 bits.
[[nodiscard]] inline Vec3i contact_force(const ContactLaw& law, std::int32_t overlap, const Vec3i& n,
                                         const Vec3i& u) {
  const std::int32_t along = (u[0] * n[0] + u[1] * n[1] + u[2] * n[2]) >> 11;
  const std::int32_t push =
      std::clamp((law.spring * overlap >> 11) + (law.shear * along >> 11), -kMostPush, kMostPush);
  Vec3i force{};
  for (std::size_t i = 0; i < 3; ++i) force[i] = (law.drag * u[i] >> 9) - (push * n[i] >> 11);
  return force;
}

}  // namespace tandem
