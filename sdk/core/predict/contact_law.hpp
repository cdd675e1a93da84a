#pragma once
// The force of one contact, as idl/PROTOCOL.md has it.

#include <algorithm>
#include <cstdint>

#include "sdk/core/predict/contact_pairs.hpp"

namespace tandem {

inline constexpr std::int32_t kMostSpeed = 1 << 16;  ///< of two bodies towards each other, 1/4 grid unit
inline constexpr std::int32_t kMostPush = 1 << 18;   ///< 1/16 grid unit
inline constexpr std::int32_t kFarthest = 1 << 14;   ///< grid units, between bodies that touch

/// A velocity, in 1/64 lattice unit, as the law has it.
[[nodiscard]] inline std::int32_t contact_speed(const ContactLaw& law, std::int32_t v) {
  return std::clamp(v >> (law.shift + 4), -kMostSpeed, kMostSpeed);
}

/// With `overlap` in grid units (at most 2^14), `n` in 2^-12 towards the other, `u` the other's velocity.
/// |u| <= 2^16 on each axis, |n| < 2^12.5, spring <= 2^16, shear <= 2^13, drag <= 2^14: all of it fits 32
/// bits.
[[nodiscard]] inline Vec3i contact_force(const ContactLaw& law, std::int32_t overlap, const Vec3i& n,
                                         const Vec3i& u) {
  const std::int32_t along = (u[0] * n[0] + u[1] * n[1] + u[2] * n[2]) >> 12;
  const std::int32_t push =
      std::clamp((law.spring * overlap >> 10) + (law.shear * along >> 11), -kMostPush, kMostPush);
  Vec3i force{};
  for (std::size_t i = 0; i < 3; ++i) force[i] = (law.drag * u[i] >> 11) - (push * n[i] >> 12);
  return force;
}

}  // namespace tandem
