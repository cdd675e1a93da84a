#pragma once
// The tracker's encoder for one body: chooses the point inside the error ball to which the body is corrected.
// Nothing here is on the wire.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "sdk/core/codec/rounding.hpp"
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
  /// The costs of a length after its sign, length >= 1, and of the next longer one; `longest` as in
  /// magnitude_model().
  [[nodiscard]] std::array<std::uint32_t, 2> lengths(const TrackerContext& context, std::uint32_t axis,
                                                     std::uint32_t longest, std::uint32_t length) const {
    const auto largest = static_cast<std::uint32_t>(longest > 0) + static_cast<std::uint32_t>(longest > 2);
    const std::uint32_t row = context.magnitude[axis] * TrackerModelIndex::kLargest + largest +
                              (context.steps != TrackerModelIndex::kSteps ? kContexts : 0);
    const auto& of_row = lengths_[row];
    if (length + 1 < of_row.size()) return {of_row[length], of_row[length + 1]};
    const auto one = [&](std::uint32_t n) {
      return n < of_row.size() ? of_row[n] : beyond_[row] + beyond(context, n);
    };
    return {one(length), one(length + 1)};
  }

  std::array<std::array<std::uint16_t, 2>, TrackerModelIndex::kDead> of{};

 private:
  static constexpr std::uint32_t kContexts =
      TrackerModelIndex::kLasts * TrackerModelIndex::kRecents * TrackerModelIndex::kLargest;
  /// The additional cost of a length beyond all classes.
  [[nodiscard]] std::uint32_t beyond(const TrackerContext& context, std::uint32_t length) const;

  // By context, those of positions first, then those of orientations: the costs of lengths that are in a
  // class, and of being beyond all classes.
  std::array<std::array<std::uint16_t, tracker_detail::kBeyondClasses>, std::size_t{2} * kContexts>
      lengths_{};
  std::array<std::uint32_t, std::size_t{2} * kContexts> beyond_{};
};

/// A coder for code_steps() that adds up the costs of decisions.
struct CostCoder {
  const TrackerCosts* costs = nullptr;
  std::uint32_t cost = 0;
  bool code(bool bit, std::uint32_t model) {
    cost += costs->of[model][bit ? 1 : 0];
    return bit;
  }
  bool code_sign(bool bit, std::uint32_t model) { return code(bit, model); }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }
};

/// The costs of an axis in 1/256 bits: [earlier axes that are not zero][longer], for a length of `shorter`
/// and for one more. `negative`: 1 if its steps are. `before`: the longest shorter length of earlier axes, at
/// least 1; an estimate, because their longer choices count as the shorter ones.
using AxisCosts = std::array<std::array<std::uint32_t, 2>, 3>;
template <std::uint32_t axis>
[[nodiscard]] inline AxisCosts axis_costs(std::uint32_t shorter, std::uint32_t negative, std::uint32_t before,
                                          const TrackerCosts& costs, const TrackerContext& context) {
  AxisCosts result{};
  const std::uint32_t sign = costs.of[context.sign[axis]][negative];
  const std::uint32_t from = std::max(shorter, 1U);
  // Contexts ask how long earlier axes are, not how many of them move.
  const std::array<std::uint32_t, 2> first = costs.lengths(context, axis, 0, from);
  std::array<std::uint32_t, 2> later = first;
  if constexpr (axis != 0) later = costs.lengths(context, axis, before, from);
  for (std::uint32_t moved = 0; moved <= axis; ++moved) {
    std::array<std::uint16_t, 2> is_moved{0, 0};
    if (axis != 2 || moved != 0) is_moved = costs.of[zero_model(context, axis, moved)];
    const auto& [one, two] = moved == 0 ? first : later;
    const std::uint32_t moves = is_moved[1] + sign;
    result[moved] = {shorter == 0 ? is_moved[0] : moves + one, moves + (shorter == 0 ? one : two)};
  }
  return result;
}

/// axis_costs() of x, y and z.
[[nodiscard]] inline std::array<AxisCosts, 3> all_axis_costs(const std::array<std::uint32_t, 3>& shorter,
                                                             const std::array<std::uint32_t, 3>& negative,
                                                             const TrackerCosts& costs,
                                                             const TrackerContext& context) {
  const std::uint32_t before_y = std::max(shorter[0], 1U), before_z = std::max(before_y, shorter[1]);
  return {axis_costs<0>(shorter[0], negative[0], 1, costs, context),
          axis_costs<1>(shorter[1], negative[1], before_y, costs, context),
          axis_costs<2>(shorter[2], negative[2], before_z, costs, context)};
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

/// One body in one frame.
struct JointResidual {
  const BodyState& predicted;
  const BodyState& target;
  std::int32_t radius = 0;  ///< lattice units
  std::int32_t threshold = 0;
  Rounding rounding;  ///< as in the frame
};

/// Fills steps, turn and fine of `correction`. It tries the points around the missing correction. Among those
/// that leave the surface within the threshold it takes the one with the minimum of bits + worth of the
/// error. If there is none, it returns false and takes the point with the minimum error.
bool choose_joint_steps(const JointResidual& body, const ErrorWorth& worth, const TrackerCosts& costs,
                        const TrackerContext& position, const TrackerTurnContext& turn,
                        TrackerTurningCorrection& correction);

}  // namespace tandem
