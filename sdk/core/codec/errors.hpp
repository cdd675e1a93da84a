#pragma once
// Computes the errors of bodies, and finds the bodies whose error is above the threshold.

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>

#include "sdk/core/codec/selection.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// The exact value of |a - b|; up to 2^31.
[[nodiscard]] inline std::uint32_t magnitude(std::int32_t a, std::int32_t b) {
  const auto d = static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b);
  return a < b ? 0U - d : d;
}

/// The exact squared position error of a body.
[[nodiscard]] inline std::uint64_t error_squared(const State& state, const State& target, Slot slot) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint64_t d = magnitude(state.p(i)[slot], target.p(i)[slot]);
    sum += d * d;
  }
  return sum;
}

/// Calls f(slot, surface error) for every alive body of the block whose surface may be off by more than
/// `threshold`, ascending. `radii` by type.
template <class F>
void for_each_surface_beyond(const State& state, const State& target, const Block& block,
                             std::int32_t threshold, std::span<const std::int32_t> radii, F&& f) {
  for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
    if (state.alive()[slot] == 0) continue;
    const std::uint64_t error =
        surface_error(state.body(slot), target.body(slot), radii[target.type()[slot]]);
    if (error > static_cast<std::uint64_t>(threshold)) f(slot, error);
  }
}

/// Marks with 1 the slots of a block whose error may be above `threshold`. All slots marked 0 are certainly
/// within it. `marks` holds kBlockSlots bytes; the last eight are padded with zeros. A plain loop over
/// columns, vectorised.
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
