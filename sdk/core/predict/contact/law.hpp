#pragma once
// The force of one contact, as in idl/PROTOCOL.md.

#include <algorithm>
#include <array>
#include <cstdint>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

inline constexpr std::int32_t kMaxSpeed = (1 << 14) - 1;  ///< maximum speed of a body, grid units per frame
inline constexpr std::int32_t kMaxPush = (1 << 15) - 1;   ///< maximum push, 1/8 grid unit
inline constexpr std::int32_t kMaxOverlap = 1 << 14;      ///< grid units

/// Converts a velocity in 1/64 lattice unit to the law's unit.
[[nodiscard]] inline std::int32_t contact_speed(const ContactLaw& law, std::int32_t v) {
  return std::clamp(v >> (law.shift + 6), -kMaxSpeed, kMaxSpeed);
}

// A penalty contact: a spring K pushes bodies apart by their overlap o, a damper B acts on the relative
// velocity u, and friction S on the part of it across the contact. With the unit normal n,
//   f = B u + S (u - (u . n) n) - K o n = (B + S) u - (K o + S (u . n)) n :
// `drag` is B + S, and the bracket is `push`.
//
// Units: o and u in grid units, f in 1/16 grid unit per sub-step, `push` in 1/8, n in 2^-12; K in 2^-14, B
// and S in 2^-13. So drag u >> 9 is in f's unit, K o >> 11 in that of `push`, and push n >> 11 in f's; (u .
// n) >> 11 is twice the speed along the contact, as S counts in 2^-13 and K in 2^-14.
//
// Usual values of a sub-step: K 0.2 to 0.5, B and S 0.03 to 0.05. In a pile, where a body has a dozen
// neighbours, the step oscillates with K above 5/8 (in_one_step()). With a weak spring the lower bodies of a
// pile sink into each other.
/// The force of one contact, or of several in vectors. `n` in 2^-12 points towards the other body; `u` is the
/// other's velocity minus the own. |u| < 2^15 on each axis, |n| < 2^12.5, spring <= 2^16, shear <= 2^13, drag
/// <= 2^14: everything fits 32 bits.
template <class X>
[[nodiscard]] inline std::array<X, 3> contact_force(const ContactLaw& law, X overlap,
                                                    const std::array<X, 3>& n, const std::array<X, 3>& u) {
  const X along = (u[0] * n[0] + u[1] * n[1] + u[2] * n[2]) >> 11;
  X push = (law.spring * overlap >> 11) + (law.shear * along >> 11);
  push = push < -kMaxPush ? X{} - kMaxPush : push;
  push = push > kMaxPush ? X{} + kMaxPush : push;
  std::array<X, 3> force{};
  for (std::size_t i = 0; i < 3; ++i) force[i] = (law.drag * u[i] >> 9) - (push * n[i] >> 11);
  return force;
}

}  // namespace tandem
