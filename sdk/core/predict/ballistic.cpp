// The tier `ballistic`: the paper's equation 3.1 (semi-implicit Euler, gravity and damping) on the lattice,
// plus the learned acceleration c:
//   v += g + c;  c -= (c*E + 2^15) >> 16;  v -= (v*D + 2^15) >> 16;  clamp v, c to +-2^28;
//   p += (v + 32) >> 6;  clamp p to +-2^30
#include "sdk/core/predict/ballistic.hpp"

#include <algorithm>

namespace tandem {
namespace {

// (x*k + 2^15) >> 16 exactly, by one unsigned product, which is what plain SSE2 has: with u = x + 2^31 the
// result is
// ((u*k + 2^15) >> 16) - k*2^15. Needs k < 2^16.
inline std::int32_t share_of(std::int32_t x, std::uint32_t k) {
  const std::uint64_t u = static_cast<std::uint32_t>(x) ^ 0x80000000U;
  return static_cast<std::int32_t>(static_cast<std::uint32_t>((u * k + 0x8000U) >> 16U) - (k << 15U));
}

inline std::int32_t clamp_velocity(std::int32_t x) { return std::clamp(x, -kVelocityLimit, kVelocityLimit); }

// One channel. `from` and `to` may be the same columns: slots do not depend on each other.
struct Columns {
  const std::int32_t* p;
  const std::int32_t* v;
  const std::int32_t* c;
  std::int32_t* p_to;
  std::int32_t* v_to;
  std::int32_t* c_to;
};

// |v|, |g|, |c| <= 2^28, so their sum stays inside 32 bits. Without decay c is within its limits already.
template <bool Decays>
inline void step_one(const Columns& x, std::size_t s, std::int32_t gravity, std::uint32_t damping,
                     std::uint32_t decay) {
  std::int32_t c = x.c[s];
  std::int32_t v = x.v[s] + gravity + c;
  if constexpr (Decays) c = clamp_velocity(c - share_of(c, decay));
  v = clamp_velocity(v - share_of(v, damping));
  x.p_to[s] = std::clamp(x.p[s] + ((v + 32) >> 6), -kPositionLimit, kPositionLimit);
  x.v_to[s] = v;
  x.c_to[s] = c;
}

#if defined(__clang__)
#define TANDEM_INDEPENDENT_LOOP _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define TANDEM_INDEPENDENT_LOOP _Pragma("GCC ivdep")
#else
#define TANDEM_INDEPENDENT_LOOP
#endif

// A dead slot is all zero; without gravity it stays so, which keeps the loop free of branches.
template <bool Decays>
void step_channel(const Columns x, const std::uint8_t* alive, std::size_t count, std::int32_t gravity,
                  std::uint32_t damping, std::uint32_t decay) {
  TANDEM_INDEPENDENT_LOOP
  for (std::size_t s = 0; s < count; ++s) {
    step_one<Decays>(x, s, gravity & -static_cast<std::int32_t>(alive[s]), damping, decay);
  }
}

Columns columns(const State& from, State& to, std::size_t channel) {
  return {from.p(channel).data(), from.v(channel).data(), from.c(channel).data(),
          to.p(channel).data(),   to.v(channel).data(),   to.c(channel).data()};
}

}  // namespace

void Ballistic::step(const State& from, State& to, const Drive& drive) {
  if (&from != &to) {
    std::ranges::copy(from.alive(), to.alive().begin());
    std::ranges::copy(from.generation(), to.generation().begin());
    std::ranges::copy(from.type(), to.type().begin());
  }
  const auto step_all = drive.decay != 0 ? step_channel<true> : step_channel<false>;
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    step_all(columns(from, to, i), from.alive().data(), from.capacity(), drive.gravity[i], drive.damping,
             drive.decay);
  }
}

void Ballistic::step_slots(const State& from, State& to, const Drive& drive, std::span<const Slot> slots) {
  for (const Slot s : slots) {
    to.alive()[s] = from.alive()[s];
    to.generation()[s] = from.generation()[s];
    to.type()[s] = from.type()[s];
  }
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    const Columns x = columns(from, to, i);
    for (const Slot s : slots) {
      step_one<true>(x, s, drive.gravity[i] & -static_cast<std::int32_t>(from.alive()[s]), drive.damping,
                     drive.decay);
    }
  }
}

}  // namespace tandem
