#pragma once
// The tracker's encoder, one body that turns at a time: whether to correct its position, its orientation or
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
  unsigned position_bits;  ///< as in the frame
};

/// Fills steps, turn and fine of `correction`: of the points around what is missing, those that leave the
/// surface within the threshold with the least bits + what the error is worth. False: none does; then the
/// ones that leave it least off.
bool choose_joint_steps(const JointResidual& body, const ErrorWorth& worth, const TrackerCosts& costs,
                        const TrackerContext& position, const TrackerTurnContext& turn,
                        TrackerCorrection& correction);

}  // namespace tandem
