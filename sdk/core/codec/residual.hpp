#pragma once
// Residuals: which bodies are off by more than the threshold, and their quantisation to eight bits.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/selection.hpp"

namespace tandem {

/// Quantised residual of a body: position x, y, z, then velocity x, y, z.
using Residual = std::array<std::int8_t, 6>;
inline constexpr std::int32_t kResidualLimit = 127;

/// |a - b| exactly; up to 2^31.
[[nodiscard]] inline std::uint32_t magnitude(std::int32_t a, std::int32_t b) {
  const auto d = static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b);
  return a < b ? 0U - d : d;
}

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

/// p += q * position_step, v += q * velocity_step, clamped to the lattice.
inline void apply_residual(State& state, Slot slot, const Residual& q, const CodecParameters& parameters) {
  const auto moved = [](std::int32_t from, std::int8_t steps, std::int32_t step, std::int64_t limit) {
    return static_cast<std::int32_t>(std::clamp(from + std::int64_t{steps} * step, -limit, limit));
  };
  for (std::size_t i = 0; i < 3; ++i) {
    std::int32_t& p = state.p(i)[slot];
    std::int32_t& v = state.v(i)[slot];
    p = moved(p, q[i], parameters.position_step, kPositionLimit);
    v = moved(v, q[i + 3], parameters.velocity_step, kVelocityLimit);
  }
}

/// Exact squared position error of a body.
[[nodiscard]] inline std::uint64_t error_squared(const State& state, const State& target, Slot slot) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint64_t d = magnitude(state.p(i)[slot], target.p(i)[slot]);
    sum += d * d;
  }
  return sum;
}

/// Marks (1) the slots of a block that may be off by more than `threshold`, and none of the others (0) is.
/// `marks` holds kBlockSlots bytes; the last eight are padded with zeros. Plain loop over columns,
/// vectorised.
void mark_suspects(const State& state, const State& target, const Block& block, std::int32_t threshold,
                   std::span<std::uint8_t, kBlockSlots> marks);

/// Calls f(slot, error squared) for every alive body of the block whose position is off by more than
/// `threshold`, ascending. `marks` is scratch memory.
template <class F>
void for_each_beyond(const State& state, const State& target, const Block& block, std::int32_t threshold,
                     std::span<std::uint8_t, kBlockSlots> marks, F&& f) {
  mark_suspects(state, target, block, threshold, marks);
  const auto limit = static_cast<std::uint64_t>(threshold) * static_cast<std::uint64_t>(threshold);
  for (std::uint32_t at = 0; at < block.slots; at += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, marks.data() + at, sizeof eight);
    for (; eight != 0; eight &= eight - 1) {
      const Slot slot = block.first + at + static_cast<std::uint32_t>(std::countr_zero(eight)) / 8;
      const std::uint64_t error = error_squared(state, target, slot);
      if (error > limit && state.alive()[slot] != 0) f(slot, error);
    }
  }
}

}  // namespace tandem
