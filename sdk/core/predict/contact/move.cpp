#include "sdk/core/predict/contact/move.hpp"

#include <bit>
#include <cstring>

#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/contact/law.hpp"

namespace tandem {
namespace {

// Three axes at once, and what follows them in memory.
using Four = std::int32_t __attribute__((vector_size(16)));
using FourWords = std::int16_t __attribute__((vector_size(8)));
using FourBits = std::uint32_t __attribute__((vector_size(16)));

constexpr std::int32_t kForceLimit = 1 << 26;  // times a mobility of 16 a velocity stays below 2^31

// The count of a shift, read anew: once clang 14 has moved a vector of it out of a loop, it does not know any
// more that all counts are the same, and for WebAssembly shifts element by element.
inline std::int32_t here(std::int32_t count) {
#ifdef __wasm_simd128__
  __asm__ volatile("" : "+r"(count));
#endif
  return count;
}
inline Four same(std::int32_t x) { return Four{x, x, x, x}; }
inline Four clamped(Four x, Four limit) {
  x = x < -limit ? -limit : x;
  return x > limit ? limit : x;
}
template <class T>
inline Four load(const T& from) {
  Four x;
  std::memcpy(&x, &from, sizeof x);
  return x;
}

// (x * share + half) >> (16 + bits) in 32 bits, for share < 2^16: the halves of x one by one.
inline Four share_of(Four x, Four share, std::uint32_t bits, std::uint32_t half) {
  const auto low = reinterpret_cast<FourBits>(x) & 0xFFFFU;
  const FourBits carry = (low * reinterpret_cast<FourBits>(share) + half) >> 16U;
  return ((x >> 16) * share + reinterpret_cast<Four>(carry)) >> static_cast<std::int32_t>(bits);
}

inline ContactView view(Four p_and_radius, Four v, std::int32_t shift) {
  const FourWords places = __builtin_convertvector(p_and_radius >> here(shift), FourWords);
  const FourWords speeds =
      __builtin_convertvector(clamped(v >> here(shift + 6), same(kMostSpeed)), FourWords);
  ContactView view{};
  std::memcpy(&view.q, &places, sizeof places);
  std::memcpy(&view.v, &speeds, sizeof speeds);
  return view;
}

}  // namespace

TANDEM_VECTOR_CLONES void move_bodies(const ContactMove& move, std::span<ContactBody> bodies,
                                      std::span<ContactForce> forces,
                                      std::span<const ContactForce> accelerations,
                                      std::span<ContactView> views) {
  const auto shift = static_cast<std::int32_t>(move.shift);
  const std::int32_t force_shift = shift + 2;
  const Four gravity{move.gravity[0], move.gravity[1], move.gravity[2], 0};
  const Four damping = same(static_cast<std::int32_t>(move.damping));
  const Four share = same((32768 + move.substeps / 2) / move.substeps);
  const bool halved = std::has_single_bit(static_cast<std::uint32_t>(move.substeps));
  const std::int32_t half = 32 * move.substeps;
  const std::int32_t halvings = 6 + std::countr_zero(static_cast<std::uint32_t>(move.substeps));
  const Four most_force = same(kForceLimit >> force_shift);
  const Four axes{-1, -1, -1, 0};
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    ContactBody& body = bodies[k];
    ContactForce& force = forces[k];
    if (!move.at_rest.empty() && move.at_rest[k] != 0) {
      force.f = {};
      continue;
    }
    const Four f = clamped(load(force.f), most_force) << here(force_shift);
    const Four p_and_radius = load(body.p);
    const Four v_and_slot = load(body.v);
    Four v = (v_and_slot & axes) + gravity;
    if (move.one_mobility) {
      v += f;
    } else {
      const Four mobility = same(force.mobility);
      v += f * (mobility >> 16) + share_of(f, mobility & 0xFFFF, 0, 1U << 15U);
    }
    if (!accelerations.empty()) v += load(accelerations[k].f);
    if (move.damping != 0) v -= share_of(v, damping, 0, 1U << 15U);
    v = clamped(v, same(kVelocityLimit));
    // The same where N is a power of two.
    const Four way = halved ? (v + half) >> here(halvings) : share_of(v, share, 5, 1U << 20U);
    const Four p = clamped(p_and_radius + way, same(kPositionLimit));
    const Four new_v = (v & axes) | (v_and_slot & ~axes);
    const Four new_p = (p & axes) | (p_and_radius & ~axes);
    std::memcpy(&body.v, &new_v, sizeof new_v);
    std::memcpy(&body.p, &new_p, sizeof new_p);
    force.f = {};
    views[k] = view(new_p, v & axes, shift);
  }
}

TANDEM_VECTOR_CLONES void place_bodies(std::span<const ContactBody> bodies, const ContactPlaces& places,
                                       std::span<ContactView> views) {
  const auto shift = static_cast<std::int32_t>(places.shift);
  const auto near_shift = static_cast<std::int32_t>(places.near_shift);
  const Four share = same(places.later_share);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const Four p = load(bodies[k].p);
    const Four v = load(bodies[k].v) & Four{-1, -1, -1, 0};
    views[k] = view(p, v, shift);
    const FourWords now = __builtin_convertvector(p >> here(near_shift), FourWords);
    const FourWords later =
        __builtin_convertvector((p + share_of(v, share, 5, 0)) >> here(near_shift), FourWords);
    std::memcpy(&places.xy[k], &now, sizeof(std::uint32_t));
    std::memcpy(&places.later_xy[k], &later, sizeof(std::uint32_t));
    places.z[k] = static_cast<std::uint16_t>(now[2]) | std::uint32_t{static_cast<std::uint16_t>(later[2])}
                                                           << 16U;
  }
}

}  // namespace tandem
