#pragma once
// The tracker codec's probabilities: which decisions a block codes, each in which context. One text for the
// encoder, the decoder and the encoder's estimate of costs.

#include <array>
#include <cstdint>
#include <span>

#include "sdk/core/codec/range_coder.hpp"
#include "sdk/core/codec/tracker_filter.hpp"

namespace tandem {

/// What the contexts of one body see of it, on both sides the same.
struct TrackerContext {
  std::uint32_t zero = 0;                     ///< part of the index of "is this axis untouched"
  std::uint32_t magnitude = 0;                ///< part of the index of "is it longer"
  std::array<std::uint32_t, 3> sign{};        ///< index per axis
  std::array<std::uint32_t, 3> moved_last{};  ///< 0, 1: whether the last correction moved this axis
};

/// Adaptive probabilities of one block. Plain data: copied to try things, saved in snapshots.
struct TrackerModels {
  static constexpr std::uint32_t kAges = 15, kShortAges = 5, kIntervals = 4, kUnary = 14;

  std::array<AdaptiveBit, std::size_t{kAges} * kAges * 2> flag;
  std::array<AdaptiveBit, std::size_t{kShortAges} * kIntervals * 3 * 3 * 2> zero;
  std::array<AdaptiveBit, std::size_t{kIntervals} * 3 * 3 * 3 * 3> sign;
  std::array<AdaptiveBit, std::size_t{kIntervals} * 3 * kUnary> magnitude;
  std::array<AdaptiveBit, 32> escape;

  /// Calls f(AdaptiveBit&) for every probability, in the order of snapshots.
  template <class Models, class F>
  static void for_each(Models& models, F&& f) {
    for (auto& bit : models.flag) f(bit);
    for (auto& bit : models.zero) f(bit);
    for (auto& bit : models.sign) f(bit);
    for (auto& bit : models.magnitude) f(bit);
    for (auto& bit : models.escape) f(bit);
  }
  static constexpr std::size_t kCount =
      std::size_t{kAges} * kAges * 2 + std::size_t{kShortAges} * kIntervals * 3 * 3 * 2 +
      std::size_t{81} * kIntervals + std::size_t{kIntervals} * 3 * kUnary + 32;
};

/// Buckets of frame counts 0 .. 255; see tracker_models.cpp.
extern const std::array<std::uint8_t, 256> tracker_age_buckets;

/// Index of the flag by age and by the interval before; add 1 where the body coded before it was corrected.
[[nodiscard]] inline std::uint32_t flag_context(std::uint8_t age, std::uint8_t interval) {
  return (tracker_age_buckets[age + 1U] * TrackerModels::kAges + tracker_age_buckets[interval]) * 2U;
}

namespace tracker_detail {

// 0: below -limit, 1: between, 2: above. Sums of comparisons, because branches would be hard to guess.
inline std::uint32_t side(std::int32_t value, std::int32_t limit) {
  return 1U + static_cast<std::uint32_t>(value > limit) - static_cast<std::uint32_t>(value < -limit);
}

inline std::uint32_t bucket(std::uint32_t count, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return static_cast<std::uint32_t>(count > a) + static_cast<std::uint32_t>(count > b) +
         static_cast<std::uint32_t>(count > c);
}

}  // namespace tracker_detail

/// The rest of a corrected body's context. `v`, `c`: of its predicted state; zero for a body renewed in this
/// frame.
[[nodiscard]] inline TrackerContext value_context(const TrackerBody& body, const Vec3i& v, const Vec3i& c,
                                                  std::int32_t threshold) {
  using tracker_detail::bucket;
  using tracker_detail::side;
  TrackerContext context;
  const std::uint32_t k = body.age + 1U;
  const std::uint32_t short_age = bucket(k, 2, 4, 8) + static_cast<std::uint32_t>(k > 20);
  context.zero = short_age * TrackerModels::kIntervals + bucket(body.interval, 2, 6, 20);
  context.magnitude = bucket(k, 1, 4, 20);
  const std::uint32_t sign_age = bucket(k, 2, 6, 20);
  // Below 1/51 of the threshold a frame, and 1/2048 of it a frame squared, a sign says nothing.
  const std::int32_t slow = threshold + threshold / 4;
  const std::int32_t faint = threshold / 32;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t last = side(body.steps[axis], 0);
    context.moved_last[axis] = static_cast<std::uint32_t>(body.steps[axis] != 0);
    const std::uint32_t seen = (last * 3 + side(c[axis], faint)) * 3 + side(v[axis], slow);
    context.sign[axis] =
        (static_cast<std::uint32_t>(axis) * 27 + seen) * TrackerModels::kIntervals + sign_age;
  }
  return context;
}

/// Index of "is this axis untouched", after `moved` axes that are not.
[[nodiscard]] inline std::uint32_t zero_model(const TrackerContext& context, std::uint32_t axis,
                                              std::uint32_t moved) {
  return ((axis * TrackerModels::kShortAges * TrackerModels::kIntervals + context.zero) * 3 + moved) * 2 +
         context.moved_last[axis];
}
/// Index of "is it longer than 1", after `moved` axes that are not zero; those of longer ones follow it.
[[nodiscard]] inline std::uint32_t magnitude_model(const TrackerContext& context, std::uint32_t moved) {
  return (context.magnitude * 3 + moved) * TrackerModels::kUnary;
}

/// Codes the steps of one body, not all of them zero. `Coder` has code(bit, model) and code_even(bit), both
/// returning the bit; for a decoder the argument means nothing and `steps` is filled. False: a decoder read
/// steps beyond kMostTrackerSteps.
template <class Coder, class Models>
bool code_steps(Coder& coder, Models& models, const TrackerContext& context, TrackerSteps& steps);

/// Most bits code_steps() takes.
inline constexpr std::size_t kMostStepsBits = 3 * (22 + (std::size_t{TrackerModels::kUnary} + 31) * 11 + 31);

namespace tracker_detail {

// x >= 0 as the number of bits of x + 1, in unary, then those bits without the first.
template <class Coder, class Models>
bool code_escape(Coder& coder, Models& models, std::uint32_t& x) {
  const std::uint64_t wanted = std::uint64_t{x} + 1;
  unsigned bits = 0;
  while (bits < 31 && coder.code((wanted >> (bits + 1)) != 0, models.escape[bits])) ++bits;
  std::uint64_t value = 1;
  for (unsigned i = bits; i-- > 0;) {
    value = value << 1U | static_cast<std::uint64_t>(coder.code_even(((wanted >> i) & 1U) != 0));
  }
  x = static_cast<std::uint32_t>(value - 1);
  return value - 1 <= static_cast<std::uint64_t>(kMostTrackerSteps) - TrackerModels::kUnary - 1;
}

}  // namespace tracker_detail

/// Codes one axis. `moved`: how many earlier axes are not zero. Returns as code_steps().
template <class Coder, class Models>
bool code_axis(Coder& coder, Models& models, const TrackerContext& context, std::uint32_t axis,
               std::uint32_t moved, std::int32_t& steps) {
  const std::int32_t wanted = steps;
  const bool is_last_hope = axis == 2 && moved == 0;
  if (!is_last_hope) {
    if (!coder.code(wanted != 0, models.zero[zero_model(context, axis, moved)])) {
      steps = 0;
      return true;
    }
  }
  const bool negative = coder.code(wanted < 0, models.sign[context.sign[axis]]);
  const auto length = static_cast<std::uint32_t>(wanted < 0 ? -wanted : wanted);
  const std::uint32_t base = magnitude_model(context, moved);
  std::uint32_t size = 1;
  while (size <= TrackerModels::kUnary && coder.code(length > size, models.magnitude[base + size - 1]))
    ++size;
  if (size > TrackerModels::kUnary) {
    std::uint32_t beyond = length > TrackerModels::kUnary ? length - TrackerModels::kUnary - 1 : 0;
    Coder rare = coder;  // a copy, so that a call that is not inlined leaves `coder` in registers
    const bool good = tracker_detail::code_escape(rare, models, beyond);
    coder = rare;
    if (!good) return false;
    size = TrackerModels::kUnary + 1 + beyond;
  }
  steps = negative ? -static_cast<std::int32_t>(size) : static_cast<std::int32_t>(size);
  return true;
}

template <class Coder, class Models>
bool code_steps(Coder& coder, Models& models, const TrackerContext& context, TrackerSteps& steps) {
  Coder local = coder;  // in registers: models are written through pointers in between
  std::uint32_t moved = 0;
  bool good = true;
  for (std::uint32_t axis = 0; axis < 3 && good; ++axis) {
    good = code_axis(local, models, context, axis, moved, steps[axis]);
    moved += static_cast<std::uint32_t>(steps[axis] != 0);
  }
  coder = local;
  return good;
}

}  // namespace tandem
