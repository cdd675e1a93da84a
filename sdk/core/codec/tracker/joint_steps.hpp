#pragma once
// The tracker's encoder for one body that turns: chooses whether to correct its position, its orientation or
// both, and by which steps. Nothing here is on the wire.

#include <cstdint>

#include "sdk/core/codec/tracker/filter.hpp"
#include "sdk/core/codec/tracker/steps.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// One body in one frame.
struct JointResidual {
  const BodyState& predicted;
  const BodyState& target;
  std::int32_t radius;  ///< lattice units
  std::int32_t threshold;
  Rounding rounding;  ///< as in the frame
};

/// Fills steps, turn and fine of `correction`. It tries the points around the missing correction. Among those
/// that leave the surface within the threshold it takes the one with the minimum of bits + worth of the
/// error. If there is none, it returns false and takes the point with the minimum error.
bool choose_joint_steps(const JointResidual& body, const ErrorWorth& worth, const TrackerCosts& costs,
                        const TrackerContext& position, const TrackerTurnContext& turn,
                        TrackerTurningCorrection& correction);

}  // namespace tandem
