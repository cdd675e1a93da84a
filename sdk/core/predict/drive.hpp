#pragma once
// The input of the predicted step besides the state.

#include <cstdint>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"

namespace tandem {

/// The forces on all bodies. The server converts them once from scene units. Only scheduled inputs change
/// them.
struct Drive {
  Vec3i gravity{};            ///< 1/64 lattice unit per frame^2, |g| <= 2^28
  std::uint16_t damping = 0;  ///< D: share of v lost per frame, in 1/65536
  friend bool operator==(const Drive&, const Drive&) = default;
};

/// The input of one step.
struct StepInput {
  Drive drive;                 ///< drive of the frame that the step produces
  StepParameters parameters;   ///< parameters of the previous delta
  std::int32_t threshold = 1;  ///< the codec's, of the previous delta
  Vec3i gravity_before{};      ///< gravity of the drive of the previous frame
  friend bool operator==(const StepInput&, const StepInput&) = default;
};

}  // namespace tandem
