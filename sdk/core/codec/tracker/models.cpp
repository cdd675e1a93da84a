#include "sdk/core/codec/tracker/models.hpp"

#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

constexpr std::array<std::uint8_t, 256> make_age_buckets() {
  std::array<std::uint8_t, 256> buckets{};
  for (std::uint32_t count = 0; count < 256; ++count)
    buckets[count] = tracker_age_bucket(static_cast<std::uint8_t>(count));
  return buckets;
}

// 2^-10 rad per frame: the sign of a smaller angular velocity says nothing.
constexpr std::int32_t kSlowTurn = 1 << 18;
// 2^-6 rad per frame: with a faster turn steps are long.
constexpr std::int32_t kFastTurn = 1 << 22;

// The number of limits below n.
template <class... Limits>
std::uint8_t above(std::uint8_t n, Limits... limits) {
  return static_cast<std::uint8_t>((static_cast<std::uint8_t>(n > limits) + ...));
}

// Lists the parts of contexts that follow from ages, intervals and last steps. `sign` gets the common part of
// the signs, from bit 4 on.
TANDEM_VECTOR_CLONES void list_ages(const std::uint8_t* __restrict age,
                                    const std::uint8_t* __restrict interval, const std::int8_t* __restrict x,
                                    const std::int8_t* __restrict y, const std::int8_t* __restrict z,
                                    std::uint32_t slots, std::uint8_t* __restrict zero,
                                    std::uint8_t* __restrict sign) {
  for (std::uint32_t s = 0; s < slots; ++s) {
    // With k = age + 1, n > limit is age >= limit.
    const std::uint8_t n = age[s];
    const auto moved = static_cast<std::uint32_t>((x[s] != 0) | (y[s] != 0) << 1 | (z[s] != 0) << 2);
    zero[s] = static_cast<std::uint8_t>(above(n, 1, 3, 7, 19) * TrackerModelIndex::kIntervals +
                                        above(interval[s], 2, 6, 20) + (moved << 5U));
    sign[s] = static_cast<std::uint8_t>(std::uint32_t{above(n, 1, 5, 19)} * 16);
  }
}

// The size context of one axis: how long the last correction was, along this axis twice as important as along
// the others, and whether the body was corrected in the frame before, and is fast along this axis.
[[gnu::always_inline]] inline std::uint8_t size_context(std::uint8_t age, std::int8_t own, std::int8_t other,
                                                        std::int8_t another, std::int32_t v,
                                                        std::int32_t fast) {
  // Cut where more makes no difference, so that all fits a byte.
  const auto length = [](std::int8_t steps, int most) {
    return static_cast<std::uint8_t>(std::min(steps < 0 ? -steps : +steps, most));
  };
  const auto sum = static_cast<std::uint8_t>(2 * length(own, 13) + length(other, 25) + length(another, 25));
  const auto is_fast = static_cast<std::uint8_t>((v > fast) | (v < -fast));
  const auto recent = static_cast<std::uint8_t>(age == 0 ? is_fast : 2);
  return static_cast<std::uint8_t>(above(sum, 1, 4, 10, 24) * TrackerModelIndex::kRecents + recent);
}

// Adds the size contexts of one axis.
TANDEM_VECTOR_CLONES void list_sizes(const std::uint8_t* __restrict age, const std::int8_t* __restrict own,
                                     const std::int8_t* __restrict other,
                                     const std::int8_t* __restrict another, const std::int32_t* __restrict v,
                                     std::int32_t fast, std::uint32_t slots, std::uint8_t* __restrict size) {
  for (std::uint32_t s = 0; s < slots; ++s)
    size[s] =
        static_cast<std::uint8_t>(size[s] + size_context(age[s], own[s], other[s], another[s], v[s], fast));
}

// The sign context of one axis: the direction of the last correction, of c and of v.
[[gnu::always_inline]] inline std::uint8_t sign_context(std::int8_t last, std::int32_t c, std::int32_t v,
                                                        std::int32_t faint, std::int32_t slow) {
  // 0: below -limit, 1: between, 2: above.
  const std::int32_t side =
      9 * ((last > 0) - (last < 0)) + 3 * ((c > faint) - (c < -faint)) + ((v > slow) - (v < -slow));
  return static_cast<std::uint8_t>(side + 13);
}

// Lists the sign contexts of one axis.
TANDEM_VECTOR_CLONES void list_signs(const std::int8_t* __restrict last, const std::int32_t* __restrict c,
                                     const std::int32_t* __restrict v, std::int32_t faint, std::int32_t slow,
                                     std::uint32_t slots, std::uint8_t* __restrict sign) {
  for (std::uint32_t s = 0; s < slots; ++s) sign[s] = sign_context(last[s], c[s], v[s], faint, slow);
}

// Lists the rest context: how long the body was not corrected, whether it is at rest, and its predicted
// speed.
TANDEM_VECTOR_CLONES void list_rests(const std::uint8_t* __restrict age, const std::uint8_t* __restrict rest,
                                     const std::int32_t* __restrict x, const std::int32_t* __restrict y,
                                     const std::int32_t* __restrict z, std::int32_t slow, std::int32_t fast,
                                     std::uint32_t slots, std::uint8_t* __restrict context) {
  for (std::uint32_t s = 0; s < slots; ++s) {
    const auto faster = [&](std::int32_t than) {
      return static_cast<std::uint8_t>((x[s] > than) | (x[s] < -than) | (y[s] > than) | (y[s] < -than) |
                                       (z[s] > than) | (z[s] < -than));
    };
    const auto times = rest[s] * TrackerModelIndex::kShortAges + above(age[s], 1, 3, 7, 19);
    context[s] = static_cast<std::uint8_t>(times * TrackerModelIndex::kSpeeds + faster(slow) + faster(fast));
  }
}

TANDEM_VECTOR_CLONES void list_flag_models(const std::uint8_t* __restrict age,
                                           const std::uint8_t* __restrict history,
                                           const std::uint8_t* __restrict rest,
                                           const std::uint8_t* __restrict alive, std::uint32_t slots,
                                           std::uint16_t* __restrict models) {
  constexpr std::uint32_t kHistories = TrackerModelIndex::kAges * TrackerModelIndex::kLengths;
  for (std::uint32_t s = 0; s < slots; ++s) {
    std::uint8_t bucket = 0;
    for (const std::uint8_t last : tracker_detail::kLastOfRun)
      bucket = static_cast<std::uint8_t>(bucket + (age[s] >= last));
    const std::uint32_t moving = TrackerModelIndex::kFlag + bucket * kHistories + history[s];
    const std::uint32_t model = rest[s] != 0 ? TrackerModelIndex::kFlagAtRest + bucket : moving;
    models[s] = static_cast<std::uint16_t>(alive[s] != 0 ? model : TrackerModelIndex::kDead);
  }
}

}  // namespace

void list_flag_models(const std::uint8_t* ages, const std::uint8_t* histories, const std::uint8_t* rest,
                      const std::uint8_t* alive, std::span<std::uint16_t> models) {
  list_flag_models(ages, histories, rest, alive, static_cast<std::uint32_t>(models.size()), models.data());
}

const std::array<std::uint8_t, 256> tracker_age_buckets = make_age_buckets();

TrackerModels::TrackerModels() {
  std::fill(p1.begin(), p1.begin() + TrackerModelIndex::kSteps, kRare);
  std::fill(p1.begin() + TrackerModelIndex::kSteps, p1.end(), std::uint16_t{32768});
  p1[TrackerModelIndex::kDead] = 0;
}

void TrackerContexts::fill(const Block& block, const State& predicted,
                           const std::array<const std::uint8_t*, 5>& bodies, std::int32_t threshold) {
  const Slot first = block.first;
  const auto steps = [&](std::size_t axis) {
    return reinterpret_cast<const std::int8_t*>(bodies[2 + axis]) + first;
  };
  list_ages(bodies[0] + first, bodies[1] + first, steps(0), steps(1), steps(2), block.slots,
            column(0) + first, column(1) + first);
  for (std::size_t axis = 1; axis < 3; ++axis)
    std::fill_n(column(1 + axis) + first, block.slots, std::uint8_t{0});
  // Below 1/51 of the threshold per frame, and 1/2048 of it per frame squared, a sign says nothing.
  for (std::size_t axis = 0; axis < 3; ++axis)
    list_signs(steps(axis), predicted.c(axis).data() + first, predicted.v(axis).data() + first,
               threshold / 32, threshold + threshold / 4, block.slots, column(4 + axis) + first);
  // 20/64, one, and three halves of a threshold per frame.
  const auto speed = [threshold](std::int64_t share) {
    return static_cast<std::int32_t>(std::min<std::int64_t>(share * threshold, kVelocityLimit));
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    list_sizes(bodies[0] + first, steps(axis), steps((axis + 1) % 3), steps((axis + 2) % 3),
               predicted.v(axis).data() + first, speed(96), block.slots, column(1 + axis) + first);
  list_rests(bodies[0] + first, predicted.rest().data() + first, predicted.v(0).data() + first,
             predicted.v(1).data() + first, predicted.v(2).data() + first, speed(20), speed(64), block.slots,
             column(kColumns - 1) + first);
}

TrackerBody merged(const TrackerBody& position, const TrackerBody& turn) {
  TrackerBody body = position;
  body.age = std::min(position.age, turn.age);
  if (turn.interval != 0 && (body.interval == 0 || turn.interval < body.interval))
    body.interval = turn.interval;
  if (tracker_detail::length_class(turn.steps) > tracker_detail::length_class(body.steps))
    body.steps = turn.steps;
  return body;
}

TrackerTurnContext turn_context(const TrackerBody& position, const TrackerBody& turn, const Spin& w) {
  TrackerTurnContext context;
  const std::uint32_t last = position.age == turn.age ? 0 : position.age < turn.age ? 1 : 2;
  const auto age = [](const TrackerBody& body) {
    return std::uint32_t{above(static_cast<std::uint8_t>(body.age), 1, 3, 7, 19)};
  };
  context.choice =
      (last * TrackerModelIndex::kShortAges + age(position)) * TrackerModelIndex::kShortAges + age(turn);
  std::uint8_t zero = 0, sign_age = 0;
  // The values as columns of one slot.
  const auto turn_age = static_cast<std::uint8_t>(turn.age);
  const auto interval = static_cast<std::uint8_t>(turn.interval);
  std::array<std::int8_t, 3> last_steps{};
  for (std::size_t i = 0; i < 3; ++i) last_steps[i] = static_cast<std::int8_t>(turn.steps[i]);
  list_ages(&turn_age, &interval, &last_steps[0], &last_steps[1], &last_steps[2], 1, &zero, &sign_age);
  TrackerContext& steps = context.turn;
  steps.steps = TrackerModelIndex::kTurnSteps;
  steps.zero = zero & 31U;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    steps.magnitude[axis] = size_context(turn_age, last_steps[axis], last_steps[(axis + 1) % 3],
                                         last_steps[(axis + 2) % 3], w[axis], kFastTurn);
    const std::uint8_t sign = sign_context(last_steps[axis], 0, w[axis], 0, kSlowTurn);
    steps.moved_last[axis] = (zero >> (5U + axis)) & 1U;
    steps.sign[axis] = steps.steps + TrackerModelIndex::kSign +
                       (axis * 27 + sign) * TrackerModelIndex::kIntervals + (sign_age >> 4U);
  }
  return context;
}

// The mean of a model's decisions, each counted once, with one that says what p1 was at the start:
//   p1' = ((weight + 1) p1 + 65536 ones) / (weight + 1 + seen),  weight' = min(weight + seen, 255).
// Up to 255 decisions it is their running mean. After that the past counts as 256 decisions and fades: a
// delta with n decisions moves p1 by the share n / (256 + n) of the way to their mean. With a larger limit
// models follow more slowly when a scene calms down; with a smaller one they are noisy if decisions are rare.
// This one fits a byte.
void TrackerModels::learn(const TrackerCounts& counts, std::uint32_t models) {
  for (std::size_t i = 0; i < models; ++i) {
    const std::uint32_t ones = counts[i][1];
    const std::uint32_t seen = counts[i][0] + ones;
    if (seen == 0) continue;
    const std::uint32_t before = weight[i] + 1U;
    const std::uint64_t sum = std::uint64_t{before} * p1[i] + (std::uint64_t{ones} << 16U);
    // At most 256 * 2^16 + 2^20 * 2^16 < 2^37. There are two divisions, because the 32-bit one takes a third
    // of the time and is nearly always enough.
    const std::uint64_t mean =
        sum >> 32U == 0 ? static_cast<std::uint32_t>(sum) / (before + seen) : sum / (before + seen);
    p1[i] = static_cast<std::uint16_t>(std::clamp<std::uint64_t>(mean, kLeast, kMax));
    weight[i] = static_cast<std::uint8_t>(std::min(before - 1 + seen, 255U));
  }
}

}  // namespace tandem
