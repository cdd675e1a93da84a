// The tier `ballistic`: the paper's equation 3.1 (semi-implicit Euler, gravity and damping) on the lattice, plus
// the learned acceleration c:
//   v += g + c;  c -= (c*E + 2^15) >> 16;  v -= (v*D + 2^15) >> 16;  clamp v, c to +-2^28;
//   p += (v + 32) >> 6;  clamp p to +-2^30
#include "sdk/core/predict/ballistic.hpp"

#include <algorithm>

namespace tandem {
namespace {

// (x*k + 2^15) >> 16 exactly, in 32-bit arithmetic so that compilers vectorise it: with x = h*2^16 + l,
// l in [0, 2^16), the result is h*k + ((l*k + 2^15) >> 16), and l*k + 2^15 < 2^32. Needs |x| < 2^31, k < 2^16.
inline std::int32_t share_of(std::int32_t x, std::uint32_t k) {
  const std::int32_t high = x >> 16;
  const auto low = static_cast<std::uint32_t>(x) & 0xFFFFU;
  return high * static_cast<std::int32_t>(k) + static_cast<std::int32_t>((low * k + 0x8000U) >> 16U);
}

inline std::int32_t clamp_velocity(std::int32_t x) { return std::clamp(x, -kVelocityLimit, kVelocityLimit); }

// |v|, |g|, |c| <= 2^28, so their sum stays inside 32 bits.
inline void step_one(std::int32_t p, std::int32_t v, std::int32_t c, std::int32_t gravity, std::uint32_t damping,
                     std::uint32_t decay, std::int32_t& p_out, std::int32_t& v_out, std::int32_t& c_out) {
  v += gravity + c;
  c -= share_of(c, decay);
  v -= share_of(v, damping);
  v = clamp_velocity(v);
  p_out = std::clamp(p + ((v + 32) >> 6), -kPositionLimit, kPositionLimit);
  v_out = v;
  c_out = clamp_velocity(c);
}

}  // namespace

void Ballistic::step(const State& from, State& to, const Drive& drive) {
  const std::uint32_t capacity = from.capacity();
  if (&from != &to) {
    std::ranges::copy(from.alive(), to.alive().begin());
    std::ranges::copy(from.generation(), to.generation().begin());
    std::ranges::copy(from.type(), to.type().begin());
  }
  const std::uint8_t* alive = from.alive().data();
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    const std::int32_t* p = from.p(i).data();
    const std::int32_t* v = from.v(i).data();
    const std::int32_t* c = from.c(i).data();
    std::int32_t* p_to = to.p(i).data();
    std::int32_t* v_to = to.v(i).data();
    std::int32_t* c_to = to.c(i).data();
    // A dead slot is all zero; without gravity it stays so, which keeps the loop free of branches.
    const std::int32_t gravity = drive.gravity[i];
    const std::uint32_t damping = drive.damping;
    const std::uint32_t decay = drive.decay;
    for (std::uint32_t s = 0; s < capacity; ++s) {
      const std::int32_t g = gravity & -static_cast<std::int32_t>(alive[s]);
      step_one(p[s], v[s], c[s], g, damping, decay, p_to[s], v_to[s], c_to[s]);
    }
  }
}

void Ballistic::step_slots(const State& from, State& to, const Drive& drive, std::span<const Slot> slots) {
  for (const Slot s : slots) {
    to.alive()[s] = from.alive()[s];
    to.generation()[s] = from.generation()[s];
    to.type()[s] = from.type()[s];
    const std::int32_t mask = -static_cast<std::int32_t>(from.alive()[s]);
    for (std::size_t i = 0; i < kPositionChannels; ++i) {
      step_one(from.p(i)[s], from.v(i)[s], from.c(i)[s], drive.gravity[i] & mask, drive.damping, drive.decay,
               to.p(i)[s], to.v(i)[s], to.c(i)[s]);
    }
  }
}

}  // namespace tandem
