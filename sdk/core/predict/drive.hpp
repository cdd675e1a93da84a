#pragma once
// What the predicted step reads besides the state. Gravity and damping change by scheduled input only.

#include <cstdint>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Integers of the predicted step, converted once by the server from scene units.
struct Drive {
  Vec3i gravity{};            ///< 1/64 lattice unit per frame^2, |g| <= 2^28
  std::uint16_t damping = 0;  ///< D: share of v lost per frame, in 1/65536
  /// E: share of c lost per frame, in 1/65536. A timeline fills it in from the codec's parameters; scheduled
  /// inputs do not have it.
  std::uint16_t decay = 0;
  friend bool operator==(const Drive&, const Drive&) = default;
};

}  // namespace tandem
