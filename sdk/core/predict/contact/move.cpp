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

inline Four either(Four mask, Four x, Four y) { return (x & mask) | (y & ~mask); }

// Four rows of four, turned over.
inline void transpose(std::array<Four, 4>& row) {
  const Four ab_low = __builtin_shufflevector(row[0], row[1], 0, 4, 1, 5);
  const Four ab_high = __builtin_shufflevector(row[0], row[1], 2, 6, 3, 7);
  const Four cd_low = __builtin_shufflevector(row[2], row[3], 0, 4, 1, 5);
  const Four cd_high = __builtin_shufflevector(row[2], row[3], 2, 6, 3, 7);
  row[0] = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  row[1] = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  row[2] = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  row[3] = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}

// Each element by itself: three axes of a body, or an axis of four bodies.
class Motion {
 public:
  explicit Motion(const ContactMove& move)
      : force_shift_(static_cast<std::int32_t>(move.shift) + 2),
        most_force_(same(kForceLimit >> force_shift_)),
        damped_(move.damping != 0),
        damping_(same(static_cast<std::int32_t>(move.damping))),
        one_mobility_(move.one_mobility),
        halved_(std::has_single_bit(static_cast<std::uint32_t>(move.substeps))),
        half_(32 * move.substeps),
        halvings_(6 + std::countr_zero(static_cast<std::uint32_t>(move.substeps))),
        share_(same((32768 + move.substeps / 2) / move.substeps)) {}

  void operator()(Four& p, Four& v, Four force, Four mobility, Four gravity, Four c) const {
    const Four f = clamped(force, most_force_) << here(force_shift_);
    v += gravity;
    if (one_mobility_) {
      v += f;
    } else {
      v += f * (mobility >> 16) + share_of(f, mobility & 0xFFFF, 0, 1U << 15U);
    }
    v += c;
    if (damped_) v -= share_of(v, damping_, 0, 1U << 15U);
    v = clamped(v, same(kVelocityLimit));
    // The same where N is a power of two.
    const Four way = halved_ ? (v + half_) >> here(halvings_) : share_of(v, share_, 5, 1U << 20U);
    p = clamped(p + way, same(kPositionLimit));
  }

 private:
  std::int32_t force_shift_;
  Four most_force_;
  bool damped_;
  Four damping_;
  bool one_mobility_, halved_;
  std::int32_t half_, halvings_;
  Four share_;
};

inline ContactView view(Four p_and_radius, Four v, std::int32_t shift) {
  const FourWords places = __builtin_convertvector(p_and_radius >> here(shift), FourWords);
  const FourWords speeds =
      __builtin_convertvector(clamped(v >> here(shift + 6), same(kMostSpeed)), FourWords);
  ContactView view{};
  std::memcpy(&view.q, &places, sizeof places);
  std::memcpy(&view.v, &speeds, sizeof speeds);
  return view;
}

// Some slots that follow each other, in the last sub-step. Inlined, as each copy for a processor has its own.
template <std::size_t kCount>
[[gnu::always_inline]] inline void move_slots(const Motion& motion, const ContactMove& move,
                                              std::span<const ContactBody> bodies,
                                              std::span<const ContactForce> forces,
                                              std::span<const std::uint32_t> place, Slot first, State& to) {
  std::array<Four, 4> p{}, v{}, f{};
  Four living{}, still{};
  for (std::size_t k = 0; k < kCount; ++k) {
    const std::uint32_t at = place[first + k];
    p[k] = load(bodies[at].p);
    v[k] = load(bodies[at].v);
    f[k] = load(forces[at].f);
    living[k] = -std::int32_t{to.alive()[first + k]};
    if (!move.at_rest.empty()) still[k] = -std::int32_t{move.at_rest[first + k]};
  }
  transpose(p);
  transpose(v);
  transpose(f);
  for (std::size_t i = 0; i < 3; ++i) {
    Four c{};
    if (move.accelerated != nullptr)
      std::memcpy(&c, move.accelerated->c(i).data() + first, kCount * sizeof c[0]);
    Four new_p = p[i];
    Four new_v = v[i];
    motion(new_p, new_v, f[i], f[3], same(move.gravity[i]), c);
    new_p = either(still, p[i], new_p) & living;
    new_v = either(still, v[i], new_v) & living;
    std::memcpy(to.p(i).data() + first, &new_p, kCount * sizeof new_p[0]);
    std::memcpy(to.v(i).data() + first, &new_v, kCount * sizeof new_v[0]);
  }
}

}  // namespace

TANDEM_VECTOR_CLONES void place_bodies(std::span<const ContactBody> bodies, const ContactPlaces& places,
                                       std::span<ContactView> views, std::span<ContactForce> forces) {
  const auto shift = static_cast<std::int32_t>(places.shift);
  const auto near_shift = static_cast<std::int32_t>(places.near_shift);
  const Four share = same(places.later_share);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const Four p = load(bodies[k].p);
    const Four v = load(bodies[k].v) & Four{-1, -1, -1, 0};
    views[k] = view(p, v, shift);
    forces[k].f = {};
    const FourWords now = __builtin_convertvector(p >> here(near_shift), FourWords);
    std::memcpy(&places.xy[k], &now, sizeof(std::uint32_t));
    places.z[k] = static_cast<std::uint16_t>(now[2]);
    if (places.later_xy.empty()) continue;
    const FourWords later =
        __builtin_convertvector((p + share_of(v, share, 5, 0)) >> here(near_shift), FourWords);
    std::memcpy(&places.later_xy[k], &later, sizeof(std::uint32_t));
    places.z[k] |= std::uint32_t{static_cast<std::uint16_t>(later[2])} << 16U;
  }
}

TANDEM_VECTOR_CLONES void move_bodies(const ContactMove& move, std::span<ContactBody> bodies,
                                      std::span<ContactForce> forces, std::span<ContactView> views) {
  const Motion motion(move);
  const auto shift = static_cast<std::int32_t>(move.shift);
  const Four gravity{move.gravity[0], move.gravity[1], move.gravity[2], 0};
  const Four axes{-1, -1, -1, 0};
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    ContactBody& body = bodies[k];
    ContactForce& force = forces[k];
    const Slot slot = body.slot;
    if (!move.at_rest.empty() && move.at_rest[slot] != 0) {
      force.f = {};
      continue;
    }
    Four c{};
    if (const State* const s = move.accelerated; s != nullptr)
      c = Four{s->c(0)[slot], s->c(1)[slot], s->c(2)[slot], 0};
    const Four p_and_radius = load(body.p);
    const Four v_and_slot = load(body.v);
    Four p = p_and_radius;
    Four v = v_and_slot & axes;
    motion(p, v, load(force.f), same(force.mobility), gravity, c);
    const Four new_v = either(axes, v, v_and_slot);
    const Four new_p = either(axes, p, p_and_radius);
    std::memcpy(&body.v, &new_v, sizeof new_v);
    std::memcpy(&body.p, &new_p, sizeof new_p);
    force.f = {};
    views[k] = view(new_p, v & axes, shift);
  }
}

TANDEM_VECTOR_CLONES void move_bodies(const ContactMove& move, std::span<const ContactBody> bodies,
                                      std::span<const ContactForce> forces,
                                      std::span<const std::uint32_t> place, State& to) {
  const Motion motion(move);
  const std::uint32_t capacity = to.capacity();
  Slot slot = 0;
  for (; slot + 4 <= capacity; slot += 4) move_slots<4>(motion, move, bodies, forces, place, slot, to);
  for (; slot < capacity; ++slot) move_slots<1>(motion, move, bodies, forces, place, slot, to);
}

}  // namespace tandem
