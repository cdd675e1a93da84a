#include "sdk/core/predict/contact/move.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/contact/law.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/predict/words/lanes.hpp"

namespace tandem {
namespace {

constexpr std::int32_t kForceLimit = 1 << 26;  // with a mobility of 16 a velocity stays below 2^31

// Reads the count of a shift again. When clang 14 has moved a vector of it out of a loop, it no longer knows
// that all counts are equal, and for WebAssembly it shifts element by element.
inline std::int32_t here(std::int32_t count) {
#ifdef __wasm_simd128__
  __asm__ volatile("" : "+r"(count));
#endif
  return count;
}

// (x * share + half) >> (16 + bits) in 32 bits, for share < 2^16: the halves of x one by one.
template <class X>
inline X share_of(X x, X share, std::int32_t bits, std::uint32_t half) {
  const auto carry = ((bits_of(x) & 0xFFFFU) * bits_of(share) + half) >> 16U;
  return ((x >> 16) * share + value_of(carry)) >> bits;
}

template <class X>
inline X either(X mask, X x, X y) {
  return (x & mask) | (y & ~mask);
}

inline std::int32_t same_as(std::int32_t x, std::int32_t /*like*/) { return x; }
inline Four same_as(std::int32_t x, Four /*like*/) { return same(x); }

// The motion of one axis of a body, of one axis of several bodies, or of all axes of one body.
struct Motion {
  explicit Motion(const ContactMove& move)
      : force_scale(4 << move.shift),
        damping(static_cast<std::int32_t>(move.damping)),
        share((32768 + move.substeps / 2) / move.substeps) {}

  /// A change of v.
  template <class X>
  [[nodiscard]] X push(X force, X mobility) const {
    const X f = clamped(force, same_as(kForceLimit / force_scale, force)) * force_scale;
    return f * (mobility >> 16) + share_of(f, mobility & 0xFFFF, 0, 1U << 15U);
  }
  /// `v` with all forces applied.
  template <class X>
  [[nodiscard]] X slowed(X v) const {
    return clamped(v - share_of(v, same_as(damping, v), 0, 1U << 15U), same_as(kVelocityLimit, v));
  }
  /// `p` after the step; a share of 1 needs no product.
  template <class X>
  [[nodiscard]] X moved(X p, X v, bool whole) const {
    const X way = whole ? (v + 32) >> 6 : share_of(v, same_as(share, v), 5, 1U << 20U);
    return clamped(p + way, same_as(kPositionLimit, p));
  }

  std::int32_t force_scale, damping, share;
};

inline ContactView view(Four p_and_radius, Four v, std::int32_t shift) {
  const FourWords places = __builtin_convertvector(p_and_radius >> here(shift), FourWords);
  const FourWords speeds = __builtin_convertvector(clamped(v >> here(shift + 6), same(kMaxSpeed)), FourWords);
  ContactView view{};
  std::memcpy(&view.q, &places, sizeof places);
  std::memcpy(&view.v, &speeds, sizeof speeds);
  return view;
}

// Consecutive slots, in the last sub-step.
struct Slots {
  static constexpr std::size_t kMaxSlots = BlockLedger::kRunSlots;
  using Column = std::array<std::int32_t, kMaxSlots>;

  Slot first = 0;
  std::size_t count = 0;
  std::array<Column, 3> f, p, v;    // p and v: the state before the sub-step
  Column mobility, living, moving;  // the last two: all bits or none
};

// Inlined, as move_columns(), because each copy for a processor needs its own.
[[gnu::always_inline]] inline void gather(const ContactMove& move, std::span<const ContactBody> bodies,
                                          const ContactTouch* touches, std::span<const std::uint32_t> place,
                                          const State& from, const State& to, Slots& slots) {
  const std::uint32_t* const at = &place[slots.first];
  for (std::size_t k = 0; k < slots.count; k += 4) {
    const Rows<Four> f =
        transposed({load<Four>(touches[at[k]].force), load<Four>(touches[at[k + 1]].force),
                    load<Four>(touches[at[k + 2]].force), load<Four>(touches[at[k + 3]].force)});
    write(&slots.f[0][k], f.of0);
    write(&slots.f[1][k], f.of1);
    write(&slots.f[2][k], f.of2);
    write(&slots.mobility[k], f.of3);
  }
  const std::uint8_t* const alive = &from.alive()[slots.first];
  const std::uint8_t* const rest = &to.rest()[slots.first];
  for (std::size_t k = 0; move.substeps > 1 && k < slots.count; ++k) {
    const bool still = rest[k] != 0;  // it may have no place
    for (std::size_t i = 0; i < 3; ++i) {
      slots.p[i][k] = still ? from.p(i)[slots.first + k] : bodies[at[k]].p[i];
      slots.v[i][k] = still ? from.v(i)[slots.first + k] : bodies[at[k]].v[i];
    }
  }
  for (std::size_t k = 0; k < slots.count; ++k) {
    slots.living[k] = -std::int32_t{alive[k]};
    slots.moving[k] = std::int32_t{rest[k]} - 1;
  }
}

// A fixed size is copied without a call.
[[gnu::always_inline]] inline void put(const Slots::Column& column, std::size_t count, std::int32_t* to) {
  if (count == Slots::kMaxSlots) {
    std::memcpy(to, column.data(), sizeof column);
  } else {
    std::copy_n(column.data(), count, to);
  }
}

// `kOnly`: the frame is one step.
template <bool kOnly>
[[gnu::always_inline]] inline void move_columns(const ContactMove& move, const Slots& slots,
                                                const State& from, State& to) {
  const Motion motion(move);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t* const p = kOnly ? &from.p(i)[slots.first] : slots.p[i].data();
    const std::int32_t* const v = kOnly ? &from.v(i)[slots.first] : slots.v[i].data();
    const std::int32_t* const c = &from.c(i)[slots.first];
    const std::int32_t gravity = move.gravity[i];
    const std::int32_t decay = move.decay;
    Slots::Column next_p, next_v, next_c;  // `to` may be `from`
    for (std::size_t k = 0; k < slots.count; ++k) {
      const std::int32_t push = motion.push(slots.f[i][k], slots.mobility[k]);
      const std::int32_t new_v = motion.slowed(v[k] + gravity + push + (kOnly ? c[k] : 0));
      const std::int32_t new_p = motion.moved(p[k], new_v, kOnly);
      next_p[k] = either(slots.moving[k], new_p, p[k]) & slots.living[k];
      next_v[k] = either(slots.moving[k], new_v, v[k]) & slots.living[k];
      next_c[k] = c[k] - (share_of(c[k], decay, 0, 1U << 15U) & slots.moving[k]);
    }
    put(next_p, slots.count, &to.p(i)[slots.first]);
    put(next_v, slots.count, &to.v(i)[slots.first]);
    put(next_c, slots.count, &to.c(i)[slots.first]);
  }
}

}  // namespace

bool any_moves(const State& from, const State& to, Slot first, std::uint32_t count) {
  const std::uint8_t* const alive = &from.alive()[first];
  const std::uint8_t* const rest = &to.rest()[first];
  std::uint8_t any = 0;
  for (std::size_t k = 0; k < count; ++k) any |= static_cast<std::uint8_t>(alive[k] & (rest[k] ^ 1U));
  return any != 0;
}

void copy_motion(const State& from, State& to, Slot first, std::uint32_t count) {
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    std::copy_n(&from.p(i)[first], count, &to.p(i)[first]);
    std::copy_n(&from.v(i)[first], count, &to.v(i)[first]);
    std::copy_n(&from.c(i)[first], count, &to.c(i)[first]);
  }
}

TANDEM_VECTOR_CLONES void place_bodies(std::span<const ContactBody> bodies, const std::uint32_t* at,
                                       std::span<const ContactForce> forces, const ContactPlaces& places,
                                       ContactTouch* touches) {
  const auto shift = static_cast<std::int32_t>(places.shift);
  const auto near_shift = static_cast<std::int32_t>(places.near_shift);
  const Four share = same(places.later_share);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const Four p = load<Four>(bodies[k].p);
    const Four v = load<Four>(bodies[k].v) & Four{-1, -1, -1, 0};
    const ContactTouch touch{view(p, v, shift), forces[k]};
    const std::uint32_t place = at[k];
    std::memcpy(&touches[place], &touch, sizeof touch);
    const FourWords now = __builtin_convertvector(p >> here(near_shift), FourWords);
    std::memcpy(&places.xy[place], &now, sizeof(std::uint32_t));
    places.z[place] = static_cast<std::uint16_t>(now[2]);
    if (places.later_xy == nullptr) continue;
    const FourWords later =
        __builtin_convertvector((p + share_of(v, share, 5, 0)) >> here(near_shift), FourWords);
    std::memcpy(&places.later_xy[place], &later, sizeof(std::uint32_t));
    places.z[place] |= std::uint32_t{static_cast<std::uint16_t>(later[2])} << 16U;
  }
}

TANDEM_VECTOR_CLONES void move_bodies(const ContactMove& move, std::span<ContactBody> bodies,
                                      ContactTouch* touches) {
  const Motion motion(move);
  const auto shift = static_cast<std::int32_t>(move.shift);
  const Four gravity{move.gravity[0], move.gravity[1], move.gravity[2], 0};
  const Four axes{-1, -1, -1, 0};
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    ContactBody& body = bodies[k];
    ContactForce& force = touches[k].force;
    const Slot slot = body.slot;
    if (move.at_rest[slot] != 0) {
      force.f = {};
      continue;
    }
    Four c{};
    if (const State* const s = move.accelerated; s != nullptr)
      c = Four{s->c(0)[slot], s->c(1)[slot], s->c(2)[slot], 0};
    const Four p_and_radius = load<Four>(body.p);
    const Four v_and_slot = load<Four>(body.v);
    const Four f = load<Four>(force.f);
    const Four push = motion.push(f, same(force.mobility));
    const Four v = motion.slowed((v_and_slot & axes) + gravity + push + c);
    const Four new_v = either(axes, v, v_and_slot);
    const Four new_p = either(axes, motion.moved(p_and_radius, v, false), p_and_radius);
    std::memcpy(&body.v, &new_v, sizeof new_v);
    std::memcpy(&body.p, &new_p, sizeof new_p);
    force.f = {};
    touches[k].view = view(new_p, v & axes, shift);
  }
}

TANDEM_VECTOR_CLONES void move_slots(const ContactMove& move, std::span<const ContactBody> bodies,
                                     const ContactTouch* touches, std::span<const std::uint32_t> place,
                                     Slot first, std::uint32_t count, const State& from, State& to) {
  Slots slots;
  slots.first = first;
  slots.count = count;
  gather(move, bodies, touches, place, from, to, slots);
  if (move.substeps == 1) {
    move_columns<true>(move, slots, from, to);
  } else {
    move_columns<false>(move, slots, from, to);
  }
}

}  // namespace tandem
