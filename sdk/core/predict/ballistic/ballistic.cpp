// The predictor `ballistic`: equation 3.1 of the thesis (semi-implicit Euler, gravity and damping) on the
// lattice, plus the learned acceleration c:
//   v += g + c;  c -= (c*E + 2^15) >> 16;  v -= (v*D + 2^15) >> 16;  clamp v, c to +-2^28;
//   p += (v + 32) >> 6;  clamp p to +-2^30
#include "sdk/core/predict/ballistic/ballistic.hpp"

#include <algorithm>

#include "sdk/core/lattice/slot_runs.hpp"
#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/blocks_at_rest.hpp"
#include "sdk/core/predict/rest.hpp"

namespace tandem {
namespace {

// (x*k + 2^15) >> 16 exactly, by two products of 32 bits, which every vector unit has. The upper half of x
// gives whole numbers; only the lower half is rounded. Needs k < 2^16.
inline std::int32_t share_of(std::int32_t x, std::uint32_t k) {
  const auto whole = static_cast<std::uint32_t>(x >> 16) * k;
  const std::uint32_t rest = (static_cast<std::uint32_t>(x) & 0xFFFFU) * k + 0x8000U;
  return static_cast<std::int32_t>(whole + (rest >> 16U));
}

inline std::int32_t clamp_velocity(std::int32_t x) { return std::clamp(x, -kVelocityLimit, kVelocityLimit); }

struct Motion {
  std::int32_t p;
  std::int32_t v;
  std::int32_t c;
};

// |v|, |g|, |c| <= 2^28, so their sum stays inside 32 bits.
inline Motion stepped(Motion m, std::int32_t gravity, std::uint32_t damping, std::uint32_t decay) {
  m.v += gravity + m.c;
  m.c = clamp_velocity(m.c - share_of(m.c, decay));
  m.v = clamp_velocity(m.v - share_of(m.v, damping));
  m.p = std::clamp(m.p + ((m.v + 32) >> 6), -kPositionLimit, kPositionLimit);
  return m;
}

// A dead slot is all zero; without gravity it stays so, which keeps the loops free of branches.
inline std::int32_t gravity_of(std::uint8_t alive, std::int32_t gravity) {
  return gravity & -static_cast<std::int32_t>(alive);
}

// Steps one channel. Bodies at rest do not change. Columns never overlap; with `__restrict` the compiler
// vectorises.
TANDEM_VECTOR_CLONES void step_channel(const std::uint8_t* __restrict rest, const std::int32_t* __restrict p,
                                       const std::int32_t* __restrict v, const std::int32_t* __restrict c,
                                       std::int32_t* __restrict p_to, std::int32_t* __restrict v_to,
                                       std::int32_t* __restrict c_to, const std::uint8_t* __restrict alive,
                                       std::size_t count, std::int32_t gravity, const StepInput& input) {
  const std::uint32_t damping = input.drive.damping;
  const std::uint32_t decay = input.parameters.decay;
  for (std::size_t s = 0; s < count; ++s) {
    const Motion m = stepped({p[s], v[s], c[s]}, gravity_of(alive[s], gravity), damping, decay);
    const std::int32_t still = -static_cast<std::int32_t>(rest[s]);
    p_to[s] = m.p ^ ((m.p ^ p[s]) & still);
    v_to[s] = m.v ^ ((m.v ^ v[s]) & still);
    c_to[s] = m.c ^ ((m.c ^ c[s]) & still);
  }
}

TANDEM_VECTOR_CLONES void step_channel_in_place(const std::uint8_t* __restrict rest,
                                                std::int32_t* __restrict p, std::int32_t* __restrict v,
                                                std::int32_t* __restrict c,
                                                const std::uint8_t* __restrict alive, std::size_t count,
                                                std::int32_t gravity, const StepInput& input) {
  const std::uint32_t damping = input.drive.damping;
  const std::uint32_t decay = input.parameters.decay;
  for (std::size_t s = 0; s < count; ++s) {
    const Motion m = stepped({p[s], v[s], c[s]}, gravity_of(alive[s], gravity), damping, decay);
    const std::int32_t still = -static_cast<std::int32_t>(rest[s]);
    p[s] = m.p ^ ((m.p ^ p[s]) & still);
    v[s] = m.v ^ ((m.v ^ v[s]) & still);
    c[s] = m.c ^ ((m.c ^ c[s]) & still);
  }
}

void move_all(const State& from, State& to, const StepInput& input, Slot first, std::uint32_t count) {
  const std::uint8_t* alive = from.alive().data() + first;
  const std::uint8_t* rest = to.rest().data() + first;
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    const std::int32_t gravity = input.drive.gravity[i];
    std::int32_t* const p = to.p(i).data() + first;
    std::int32_t* const v = to.v(i).data() + first;
    std::int32_t* const c = to.c(i).data() + first;
    if (&from == &to) {
      step_channel_in_place(rest, p, v, c, alive, count, gravity, input);
    } else {
      step_channel(rest, from.p(i).data() + first, from.v(i).data() + first, from.c(i).data() + first, p, v,
                   c, alive, count, gravity, input);
    }
  }
}

// Steps slots first .. first + count - 1.
void step_run(const State& from, State& to, const StepInput& input, Slot first, std::uint32_t count) {
  if (&from != &to) {
    std::copy_n(from.alive().data() + first, count, to.alive().data() + first);
    std::copy_n(from.reuse().data() + first, count, to.reuse().data() + first);
    std::copy_n(from.type().data() + first, count, to.type().data() + first);
  }
  keep_at_rest(from, to, input.drive, first, count);
  move_all(from, to, input, first, count);
  step_groups(from, to, first, count);
}

}  // namespace

void Ballistic::step(const State& from, State& to, const StepInput& input) {
  // Block by block, because what one loop reads the next finds in the cache.
  for (Slot first = 0; first < from.capacity(); first += kBlockSlots)
    step_run(from, to, input, first, std::min(kBlockSlots, from.capacity() - first));
}

void Ballistic::step_blocks(const State& from, State& to, const StepInput& input,
                            const StepLedgers& ledgers) {
  const bool lasts = rest_lasts(input);
  const auto stays = [&](std::uint32_t block) { return lasts && ledgers.from.at_rest[block] != 0; };
  const std::uint32_t blocks = block_count(from.capacity());
  moving_.clear();
  for (std::uint32_t block = 0; block < blocks; ++block) {
    if (stays(block)) {
      keep_block(from, to, block, ledgers);
    } else {
      moving_.push_back(block);
    }
  }
  run_jobs(static_cast<std::uint32_t>(moving_.size()), ledgers.run, [&](std::uint32_t i) {
    const std::uint32_t block = moving_[i];
    const Slot first = block * kBlockSlots;
    const std::uint32_t count = std::min(kBlockSlots, from.capacity() - first);
    step_run(from, to, input, first, count);
    ledgers.to.renew(block, ledgers.number);
    ledgers.to.at_rest[block] = static_cast<std::uint8_t>(all_at_rest(to, first, count));
  });
}

void Ballistic::step_slots(const State& from, State& to, const StepInput& input,
                           std::span<const Slot> slots) {
  for (const Slot s : slots) {
    to.alive()[s] = from.alive()[s];
    to.reuse()[s] = from.reuse()[s];
    to.type()[s] = from.type()[s];
    const bool still =
        from.rest()[s] != 0 && holds_still({from.c(0)[s], from.c(1)[s], from.c(2)[s]}, input.drive);
    to.rest()[s] = static_cast<std::uint8_t>(still);
  }
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    const std::int32_t* p = from.p(i).data();
    const std::int32_t* v = from.v(i).data();
    const std::int32_t* c = from.c(i).data();
    std::int32_t* p_to = to.p(i).data();
    std::int32_t* v_to = to.v(i).data();
    std::int32_t* c_to = to.c(i).data();
    for (const Slot s : slots) {
      const std::int32_t gravity = gravity_of(from.alive()[s], input.drive.gravity[i]);
      Motion m{p[s], v[s], c[s]};
      if (to.rest()[s] == 0) m = stepped(m, gravity, input.drive.damping, input.parameters.decay);
      p_to[s] = m.p;
      v_to[s] = m.v;
      c_to[s] = m.c;
    }
  }
  step_groups(from, to, slots);
}

}  // namespace tandem
