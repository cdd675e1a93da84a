#pragma once
// The tracker's encoder for one body: chooses the point inside the error ball to which the body is corrected.
// Nothing here is on the wire.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "sdk/core/codec/tracker/models.hpp"

namespace tandem {

/// log2(x) in 1/2^fraction bits, rounded down; x > 0, fraction <= 16. Integers: the same everywhere.
[[nodiscard]] constexpr std::uint32_t log2_of(std::uint32_t x, std::uint32_t fraction) {
  // x = 2^whole * mantissa. Squaring the mantissa doubles its logarithm, so each squaring that reaches 2
  // gives the next binary digit of the fraction (and halves the mantissa back to 1 .. 2).
  const auto whole = static_cast<std::uint32_t>(std::bit_width(x)) - 1U;
  std::uint64_t mantissa = (std::uint64_t{x} << 32U) >> whole;  // 1 .. 2 in 32.32
  std::uint32_t log = whole << fraction;
  for (std::uint32_t i = 1; i <= fraction; ++i) {
    mantissa = (mantissa >> 2U) * (mantissa >> 2U) >> 28U;
    if (mantissa >= std::uint64_t{2} << 32U) {
      mantissa >>= 1U;
      log |= 1U << (fraction - i);
    }
  }
  return log;
}

/// The costs of decisions in 1/256 bits: a zero and a one of each model. They are coarse on purpose (12 bits
/// of the probability, a cost of at most 12 bits), because a choice between points with a smaller difference
/// is worth nothing.
class TrackerCosts {
 public:
  void learn(const TrackerModels& models);
  /// The costs of a length of 1, 2, ... up to this; index 0 is a length of 0, which costs nothing. The last
  /// one is that of all longer lengths, without their escape.
  static constexpr std::uint32_t kLengths = TrackerModelIndex::kUnary + 2;
  using Lengths = std::array<std::uint16_t, kLengths>;
  /// The costs of lengths, after `moved` axes that are not zero.
  [[nodiscard]] const Lengths& lengths(const TrackerContext& context, std::uint32_t moved) const {
    return lengths_[(context.steps == TrackerModelIndex::kSteps ? 0 : kContexts) + context.magnitude * 3 +
                    moved];
  }
  /// What a length of at least kLengths - 1 costs in addition.
  [[nodiscard]] std::uint32_t escape(const TrackerContext& context, std::uint32_t length) const;

  std::array<std::array<std::uint16_t, 2>, TrackerModelIndex::kDead> of{};

 private:
  static constexpr std::uint32_t kContexts = TrackerModelIndex::kIntervals * TrackerModelIndex::kLengths * 3;
  std::array<Lengths, 2 * kContexts> lengths_{};  // of positions, then of orientations
};

/// A coder for code_steps() that adds up the costs of decisions.
struct CostCoder {
  const TrackerCosts* costs;
  std::uint32_t cost = 0;
  bool code(bool bit, std::uint32_t model) {
    cost += costs->of[model][bit ? 1 : 0];
    return bit;
  }
  bool code_sign(bool bit, std::uint32_t model) { return code(bit, model); }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }
};

/// The costs of an axis in 1/256 bits: [earlier axes that are not zero][longer], for a length of `shorter`
/// and for one more. `negative`: 1 if its steps are.
using AxisCosts = std::array<std::array<std::uint32_t, 2>, 3>;
template <std::uint32_t axis>
[[nodiscard]] inline AxisCosts axis_costs(std::uint32_t shorter, std::uint32_t negative,
                                          const TrackerCosts& costs, const TrackerContext& context) {
  constexpr std::uint32_t kLast = TrackerCosts::kLengths - 1;
  AxisCosts result{};
  const std::uint32_t sign = costs.of[context.sign[axis]][negative];
  const std::uint32_t at = std::min(shorter, kLast);
  const std::uint32_t next = std::min(shorter + 1, kLast);
  std::uint32_t escape = 0, next_escape = 0;
  if (next == kLast) {
    if (at == kLast) escape = costs.escape(context, shorter);
    next_escape = costs.escape(context, shorter + 1);
  }
  for (std::uint32_t moved = 0; moved <= axis; ++moved) {
    std::array<std::uint16_t, 2> is_moved{0, 0};
    if (axis != 2 || moved != 0) is_moved = costs.of[zero_model(context, axis, moved)];
    const TrackerCosts::Lengths& lengths = costs.lengths(context, moved);
    const std::uint32_t moves = is_moved[1] + sign;
    const std::uint32_t one = moves + lengths[at] + escape;
    result[moved] = {shorter == 0 ? is_moved[0] : one, moves + lengths[next] + next_escape};
  }
  return result;
}

/// The cost of an error in bits, for one threshold. It is computed once, because it takes a long division.
struct ErrorWorth {
  /// `bits`: the worth of an error of one threshold.
  ErrorWorth(std::int32_t e, std::uint64_t bits);
  std::int64_t threshold;
  std::uint64_t limit;  ///< threshold squared
  unsigned shift;       ///< limit >> shift has at most 24 bits
  std::uint64_t worth;  ///< (error^2 >> shift) * worth >> 24: in 1/256 bits
};

/// Chooses the steps that correct `to` - `from` (lattice units) at minimum cost. Among the eight points
/// around it that leave an error of at most the threshold, it takes the one with the minimum of bits + worth
/// of the error. If there is none, it returns false and `steps` is the nearest point.
bool choose_steps(const Vec3i& from, const Vec3i& to, const TrackerSteppings& steppings,
                  const ErrorWorth& worth, const TrackerCosts& costs, const TrackerContext& context,
                  TrackerSteps& steps);

/// Steps by which a body may be corrected, and their cost in 1/256 bits.
struct TrackerPoint {
  TrackerSteps steps{};
  std::uint32_t cost = 0;
};
/// The eight points of multiples of `unit` around `to` - `from`, one of which may be zero.
[[nodiscard]] std::array<TrackerPoint, 8> points_around(const Vec3i& from, const Vec3i& to, std::int32_t unit,
                                                        const TrackerCosts& costs,
                                                        const TrackerContext& context);

}  // namespace tandem
