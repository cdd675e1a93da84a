#include "sdk/core/codec/tracker/filter_run.hpp"

#include <algorithm>
#include <cstring>

#include "sdk/core/codec/tracker/models.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

// Units for which all numbers fit 32 bits: with at most 63 steps now and 127 before, the product of both in
// squares of 1/256 threshold is below 2^31; G and H are at most 128, so one step changes v by less than 2^22.
constexpr std::int32_t kMaxUnit = 1 << 14;
constexpr std::uint32_t kSlots = FilterRun::kSlots;

using Eight = std::int32_t __attribute__((vector_size(32)));
using EightBytes = std::int8_t __attribute__((vector_size(8)));
constexpr std::uint32_t kLanes = sizeof(Eight) / sizeof(std::int32_t);
static_assert(kSlots % kLanes == 0);

// The corrections of a run, slot by slot.
struct Corrected {
  std::array<std::array<std::int8_t, kSlots>, 3> steps{};
  std::array<std::int8_t, kSlots> is_corrected{}, rests{};  // -1: it is
  std::array<std::uint8_t, kSlots> k{};
  std::array<std::int32_t, kSlots> velocity{}, acceleration{};  // G and H of one step
};

struct Motion {
  std::array<std::int32_t*, 3> p{}, v{}, c{};
  std::array<const std::int8_t*, 3> last{};
};

struct Constants {
  std::array<std::int32_t, 4> units{}, relative{};  // of a step, in lattice units and in 1/256 threshold
  std::int32_t most_c = 0;
  Vec3i gravity{};
};

// Everything here is inlined always, because each copy of a caller for a processor needs its own.
[[gnu::always_inline]] inline void load(const std::int32_t* from, Eight& to) {
  std::memcpy(&to, from, sizeof to);
}
[[gnu::always_inline]] inline void load(const std::int8_t* from, Eight& to) {
  EightBytes bytes;
  std::memcpy(&bytes, from, sizeof bytes);
  to = __builtin_convertvector(bytes, Eight);
}
[[gnu::always_inline]] inline void load(const std::uint8_t* from, Eight& to) {
  using EightCounts = std::uint8_t __attribute__((vector_size(8)));
  EightCounts counts;
  std::memcpy(&counts, from, sizeof counts);
  to = __builtin_convertvector(counts, Eight);
}
[[gnu::always_inline]] inline void store(const Eight& from, std::int32_t* to) {
  std::memcpy(to, &from, sizeof from);
}
[[gnu::always_inline]] inline void limit(Eight& x, std::int32_t most) {
  x = x < -most ? Eight{} - most : x;
  x = x > most ? Eight{} + most : x;
}
[[gnu::always_inline]] inline void choose(const Eight& mask, const Eight& chosen, Eight& x) {
  x = (chosen & mask) | (x & ~mask);
}
// The size of a step in these units: as TrackerSteppings::unit_for().
[[gnu::always_inline]] inline void unit_of(const std::array<Eight, 3>& steps,
                                           const std::array<std::int32_t, 4>& units, Eight& unit) {
  const Eight moved = (steps[0] != 0) + (steps[1] != 0) + (steps[2] != 0);  // minus the number
  Eight is_long =
      (steps[0] > 1) | (steps[0] < -1) | (steps[1] > 1) | (steps[1] < -1) | (steps[2] > 1) | (steps[2] < -1);
  is_long |= moved == 0;
  unit = Eight{} + units[3];
  choose(moved == -2, Eight{} + units[2], unit);
  choose(moved == -1, Eight{} + units[1], unit);
  choose(is_long, Eight{} + units[0], unit);
}

// As TrackerFilter::move() and settle(), where the formulas are derived.
TANDEM_VECTOR_CLONES void move_all(const Corrected& corrected, std::uint32_t count, const Motion& motion,
                                   const Constants& constants) {
  for (std::uint32_t s = 0; s < count; s += kLanes) {
    Eight is_corrected, rests, k;
    load(corrected.is_corrected.data() + s, is_corrected);
    load(corrected.rests.data() + s, rests);
    load(corrected.k.data() + s, k);
    std::array<Eight, 3> steps{}, last{};
    for (std::size_t i = 0; i < 3; ++i) {
      load(corrected.steps[i].data() + s, steps[i]);
      load(motion.last[i] + s, last[i]);
    }
    Eight one, now_relative, last_relative;
    unit_of(steps, constants.units, one);
    unit_of(steps, constants.relative, now_relative);
    unit_of(last, constants.relative, last_relative);
    constexpr auto kLong = tracker_detail::kLongStep;
    Eight is_far = {};
    for (const Eight& of_axis : steps) is_far |= (of_axis >= kLong) | (of_axis <= -kLong);
    is_far &= k == 1;
    Eight product = {};
    for (std::size_t i = 0; i < 3; ++i) product += (steps[i] * now_relative) * (last[i] * last_relative);
    product >>= 8;
    limit(product, 256);
    product &= ~is_far;
    const Eight belief = (product >> 1) + 256;
    Eight velocity, acceleration;
    load(corrected.velocity.data() + s, velocity);
    choose(is_far, one * 64, velocity);  // all of a far correction counts as an error of velocity
    load(corrected.acceleration.data() + s, acceleration);
    velocity = (velocity * belief + 128) >> 8;
    acceleration = (acceleration * belief + 128) >> 8;
    for (std::size_t i = 0; i < 3; ++i) {
      Eight p, v, c;
      load(motion.p[i] + s, p);
      load(motion.v[i] + s, v);
      load(motion.c[i] + s, c);
      Eight p_to = p + steps[i] * one;
      Eight v_to = v + steps[i] * velocity;
      Eight c_to = c + steps[i] * acceleration;
      limit(p_to, kPositionLimit);
      limit(v_to, kVelocityLimit);
      limit(c_to, constants.most_c);
      v_to &= ~rests;
      choose(rests, Eight{} - constants.gravity[i], c_to);
      choose(is_corrected, p_to, p);
      choose(is_corrected, v_to, v);
      choose(is_corrected, c_to, c);
      store(p, motion.p[i] + s);
      store(v, motion.v[i] + s);
      store(c, motion.c[i] + s);
    }
  }
}

// 32 bodies at once, in signed and unsigned bytes.
using Bytes = std::uint8_t __attribute__((vector_size(32)));
using SignedBytes = std::int8_t __attribute__((vector_size(32)));
static_assert(kSlots % sizeof(Bytes) == 0);

template <class Vector, class T>
[[gnu::always_inline]] inline void load_bytes(const T* from, Vector& to) {
  std::memcpy(&to, from, sizeof to);
}
// Puts `now` where bodies are corrected.
[[gnu::always_inline]] inline void put_bytes(const Bytes& is_corrected, const Bytes& now, void* to) {
  Bytes was;
  std::memcpy(&was, to, sizeof was);
  was = (now & is_corrected) | (was & ~is_corrected);
  std::memcpy(to, &was, sizeof was);
}

// Remembers the corrections: all numbers are bytes.
TANDEM_VECTOR_CLONES void remember_all(const Corrected& corrected, std::uint32_t count, std::uint8_t youngest,
                                       const FilterColumns& columns, std::uint8_t* rest) {
  for (std::uint32_t s = 0; s < count; s += sizeof(Bytes)) {
    Bytes is_corrected, k, rests;
    load_bytes(corrected.is_corrected.data() + s, is_corrected);
    load_bytes(corrected.k.data() + s, k);
    load_bytes(corrected.rests.data() + s, rests);
    SignedBytes over_one = {}, over_two = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      SignedBytes steps;
      load_bytes(corrected.steps[axis].data() + s, steps);
      over_one |= (steps > 1) | (steps < -1);
      over_two |= (steps > 2) | (steps < -2);
      put_bytes(is_corrected, reinterpret_cast<Bytes>(steps), columns.steps[axis] + s);
    }
    // As flag_history(). Masks are -1.
    Bytes bucket = {};
    for (const std::uint8_t last : tracker_detail::kLastOfRun) bucket -= reinterpret_cast<Bytes>(k > last);
    const Bytes history = bucket * static_cast<std::uint8_t>(TrackerModelIndex::kLengths) -
                          reinterpret_cast<Bytes>(over_one) - reinterpret_cast<Bytes>(over_two);
    put_bytes(is_corrected, Bytes{} + youngest, columns.age + s);
    put_bytes(is_corrected, k, columns.interval + s);
    put_bytes(is_corrected, history, columns.history + s);
    put_bytes(is_corrected, rests & 1, rest + s);
  }
}

}  // namespace

FilterRun::FilterRun(const TrackerFilter& filter, const TrackerGains& gains) : filter_(filter) {
  for (std::size_t unit = 0; unit < velocity_.size(); ++unit) {
    const std::int64_t one = filter.coarse().unit(unit);
    fits_ = fits_ && one <= kMaxUnit;
    for (std::uint32_t k = 0; k <= kMaxAge; ++k) {
      velocity_[unit][k] = static_cast<std::int32_t>(share_of(one, gains.velocity(k)));
      acceleration_[unit][k] = static_cast<std::int32_t>(share_of(one, gains.acceleration(k)));
    }
  }
}

void FilterRun::apply(std::span<const Slot> slots, const TrackerCorrection* corrections, Slot first,
                      std::uint32_t count, const FilterColumns& columns, std::uint8_t youngest,
                      State& state) const {
  TANDEM_ASSERT(fits_ && count <= kSlots && count % sizeof(Bytes) == 0);
  TANDEM_ASSERT(slots.empty() || (slots.front() >= first && slots.back() < first + count));
  Corrected corrected;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const std::uint32_t s = slots[i] - first;
    const TrackerCorrection& correction = corrections[i];
    if (!fits(correction)) continue;
    const std::uint32_t k = std::min(columns.age[s] + 1U, kMaxAge);
    const std::size_t unit = TrackerSteppings::unit_of(correction.steps);
    for (std::size_t axis = 0; axis < 3; ++axis)
      corrected.steps[axis][s] = static_cast<std::int8_t>(correction.steps[axis]);
    corrected.is_corrected[s] = -1;
    corrected.rests[s] = static_cast<std::int8_t>(correction.rest ? -1 : 0);
    corrected.k[s] = static_cast<std::uint8_t>(k);
    corrected.velocity[s] = velocity_[unit][k];
    corrected.acceleration[s] = acceleration_[unit][k];
  }
  Motion motion;
  Constants constants;
  for (std::size_t i = 0; i < 3; ++i) {
    motion.p[i] = state.p(i).data() + first;
    motion.v[i] = state.v(i).data() + first;
    motion.c[i] = state.c(i).data() + first;
    motion.last[i] = columns.steps[i];
  }
  for (std::size_t unit = 0; unit < constants.units.size(); ++unit) {
    constants.units[unit] = filter_.coarse().unit(unit);
    constants.relative[unit] = TrackerSteppings::relative_unit(unit);
  }
  constants.most_c = static_cast<std::int32_t>(filter_.most_c());
  constants.gravity = filter_.gravity();
  move_all(corrected, count, motion, constants);
  remember_all(corrected, count, youngest, columns, state.rest().data() + first);
}

}  // namespace tandem
