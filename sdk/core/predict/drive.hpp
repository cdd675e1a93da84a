#pragma once
// What the predicted step reads besides the state.

#include <cstdint>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"

namespace tandem {

/// The forces on all bodies, converted once by the server from scene units. Changes by scheduled input only.
struct Drive {
  Vec3i gravity{};            ///< 1/64 lattice unit per frame^2, |g| <= 2^28
  std::uint16_t damping = 0;  ///< D: share of v lost per frame, in 1/65536
  friend bool operator==(const Drive&, const Drive&) = default;
};

/// Of one step.
struct StepInput {
  Drive drive;                ///< of the frame that the step produces
  StepParameters parameters;  ///< of the delta before
  friend bool operator==(const StepInput&, const StepInput&) = default;
};

}  // namespace tandem
