#pragma once
// Residuals: what is left of a body, quantised to eight bits.

#include <algorithm>
#include <array>
#include <cstdint>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/errors.hpp"

namespace tandem {

/// Quantised residual of a body: position x, y, z, then velocity x, y, z.
using Residual = std::array<std::int8_t, 6>;
inline constexpr std::int32_t kResidualLimit = 127;

/// (target - from) / step, rounded half away from zero, saturated at +-127.
[[nodiscard]] inline std::int8_t quantise(std::int32_t from, std::int32_t target, std::int32_t step) {
  const auto unit = static_cast<std::uint32_t>(step);
  const std::uint32_t steps = (magnitude(target, from) + unit / 2) / unit;
  const auto q = static_cast<std::int32_t>(std::min<std::uint32_t>(steps, kResidualLimit));
  return static_cast<std::int8_t>(target < from ? -q : q);
}

[[nodiscard]] inline Residual quantise(const State& state, const State& target, Slot slot,
                                       const CodecParameters& parameters) {
  Residual q{};
  for (std::size_t i = 0; i < 3; ++i) {
    q[i] = quantise(state.p(i)[slot], target.p(i)[slot], parameters.position_step);
    q[i + 3] = quantise(state.v(i)[slot], target.v(i)[slot], parameters.velocity_step);
  }
  return q;
}

/// rest = 0, p += q * position_step, v += q * velocity_step, clamped to the lattice.
inline void apply_residual(State& state, Slot slot, const Residual& q, const CodecParameters& parameters) {
  const auto moved = [](std::int32_t from, std::int8_t steps, std::int32_t step, std::int64_t limit) {
    return static_cast<std::int32_t>(std::clamp(from + std::int64_t{steps} * step, -limit, limit));
  };
  state.rest()[slot] = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    std::int32_t& p = state.p(i)[slot];
    std::int32_t& v = state.v(i)[slot];
    p = moved(p, q[i], parameters.position_step, kPositionLimit);
    v = moved(v, q[i + 3], parameters.velocity_step, kVelocityLimit);
  }
}

}  // namespace tandem
