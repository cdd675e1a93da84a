#pragma once
// Residuals: the differences of a body to its target, quantised to eight bits.

#include <algorithm>
#include <array>
#include <cstdint>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/errors.hpp"

namespace tandem {

/// The quantised residual of a body: x, y, z of the position, then of the velocity; with orientations then of
/// the rotation vector from predicted to target orientation and of the angular velocity, otherwise zeros.
using Residual = std::array<std::int8_t, 12>;
[[nodiscard]] constexpr std::size_t residual_vectors(const Groups& groups) {
  return groups.orientation ? 4 : 2;
}
inline constexpr std::int32_t kResidualLimit = 127;

/// (target - from) / step, rounded half away from zero, saturated at +-127.
[[nodiscard]] inline std::int8_t quantise(std::int32_t from, std::int32_t target, std::int32_t step) {
  const auto unit = static_cast<std::uint32_t>(step);
  const std::uint32_t steps = (magnitude(target, from) + unit / 2) / unit;
  const auto q = static_cast<std::int32_t>(std::min<std::uint32_t>(steps, kResidualLimit));
  return static_cast<std::int8_t>(target < from ? -q : q);
}

/// `from` moved by `q` steps (x, y, z), before limited_spin().
[[nodiscard]] inline WideSpin moved_spin(const Spin& from, const std::int8_t* q, std::int32_t step) {
  WideSpin spin{};
  for (std::size_t i = 0; i < spin.size(); ++i) spin[i] = from[i] + std::int64_t{q[i]} * step;
  return spin;
}

/// quantise() of each axis. If the result is beyond the limit, so that limited_spin() would halve it, it
/// rounds towards the slower spin.
inline void quantise_spin(const Spin& from, const Spin& target, std::int32_t step, std::int8_t* q) {
  for (std::size_t i = 0; i < kSpinChannels; ++i) q[i] = quantise(from[i], target[i], step);
  const WideSpin spin = moved_spin(from, q, step);
  const Spin limited = limited_spin(spin);
  if (std::equal(spin.begin(), spin.end(), limited.begin())) return;
  for (std::size_t i = 0; i < kSpinChannels; ++i) {
    if (magnitude(0, target[i]) < static_cast<std::uint64_t>(std::max(spin[i], -spin[i])))
      q[i] = static_cast<std::int8_t>(spin[i] > 0 ? q[i] - 1 : q[i] + 1);
  }
}

[[nodiscard]] inline Residual quantise(const State& state, const State& target, Slot slot,
                                       const CodecParameters& parameters) {
  Residual q{};
  for (std::size_t i = 0; i < 3; ++i) {
    q[i] = quantise(state.p(i)[slot], target.p(i)[slot], parameters.position_step);
    q[i + 3] = quantise(state.v(i)[slot], target.v(i)[slot], parameters.velocity_step);
  }
  if (!has_turn_steps(parameters)) return q;
  const BodyState from = state.body(slot), to = target.body(slot);
  const Spin turn = turn_between(from.q, to.q);
  for (std::size_t i = 0; i < kSpinChannels; ++i) q[6 + i] = quantise(0, turn[i], parameters.turn_step);
  quantise_spin(from.w, to.w, parameters.spin_step, &q[9]);
  return q;
}

/// Applies a residual: rest = 0; p += q * position_step and v += q * velocity_step, clamped to the lattice;
/// the orientation is turned_by() q * turn_step, w += q * spin_step after limited_spin().
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
  if (!has_turn_steps(parameters)) return;
  const BodyState from = state.body(slot);
  state.set_quaternion(slot, turned_by(from.q, moved_spin({}, &q[6], parameters.turn_step)).q);
  const Spin w = limited_spin(moved_spin(from.w, &q[9], parameters.spin_step));
  for (std::size_t i = 0; i < kSpinChannels; ++i) state.w(i)[slot] = w[i];
}

}  // namespace tandem
