#pragma once
// How far predicted and corrected bodies are from the real ones.

#include "sdk/core/lattice/state.hpp"

namespace tandem::host {

/// Distances between the centres of bodies: the root of their mean square, and the largest.
struct PositionError {
  double rms = 0, largest = 0;
};

/// Maximum number of bodies that one call compares, so that a monitor costs the same however many there are.
inline constexpr Slot kMaxCompared = 16'384;

/// Compares `agreed` with `target` in lattice units. With more than kMaxCompared slots, it takes every n-th
/// one; calls at different frames take different ones.
[[nodiscard]] PositionError position_error(const State& target, const State& agreed, Frame frame);

}  // namespace tandem::host
