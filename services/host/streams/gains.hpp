#pragma once
// Gains at run time: chooses how the tracker's filter learns from its corrections, so that no scene has to be
// trained for it. The choice travels in the deltas.

#include <cstdint>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem::host {

/// Mean cosines at which bits are fewest; see GainAim.
struct GainGoal {
  double agreement = 0.25;
  double forwardness = 0.2;
};

[[nodiscard]] GainGoal usual_gain_goal(const PredictorTraits& predictor);

/// Sets decay and gains of the first frame.
void set_first_gains(const PredictorTraits& predictor, StreamParameters& parameters);

/// Looks at every frame and decides every fifteen. Deterministic; no clock. Not thread-safe.
///
/// Where corrections agree with the one before more than the goal says, velocities learn more from them,
/// where less, less; where they agree with c, it is kept for longer. RESEARCH.md
/// has the measurements.
class GainControl {
 public:
  /// `parameters`: those in force at the start.
  GainControl(const GainGoal& goal, std::uint32_t bodies, const StreamParameters& parameters);

  /// What an encoder's observer is told.
  void observe(const GainEvidence& evidence) { evidence_.add(evidence); }
  /// After each frame; true when it changed decay and gains.
  bool after_frame(StreamParameters& parameters);

 private:
  GainGoal goal_;
  double enough_;        // corrections in one decision, to believe them
  double decay_, gain_;  // E in 1/65536, beta
  std::uint32_t frames_ = 0;
  GainEvidence evidence_;
};

}  // namespace tandem::host
