#pragma once
// The tracker's encoder for one body: chooses the point inside the error ball to which the body is corrected.
// Nothing here is on the wire.

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
struct TrackerCosts {
  void learn(const TrackerModels& models);
  std::array<std::array<std::uint16_t, 2>, TrackerModelIndex::kDead> of{};
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
