#pragma once
// Chooses gains at run time: how much the tracker's filter learns from its corrections, so that no scene has
// to be trained for it. The choice travels in the deltas.

#include <algorithm>
#include <cstdint>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem::host {

inline constexpr std::uint32_t kFramesPerDecision = 15;
/// Number of corrections that a decision needs: of a fifth of the bodies, and at least a hundred.
constexpr double enough_corrections(double bodies) { return std::max(100.0, 0.2 * bodies); }

/// Mean cosines at which a stream needs the fewest bits; see GainAim.
struct GainGoal {
  double agreement = 0.25;
  double forwardness = 0.2;
  bool operator==(const GainGoal&) const = default;
};

[[nodiscard]] GainGoal usual_gain_goal(const PredictorTraits& predictor);

/// Sets decay and gains of the first frame.
void set_first_gains(const PredictorTraits& predictor, StreamParameters& parameters);

/// Observes every frame and decides after every fifteenth. Deterministic; reads no clock. Not thread-safe.
///
/// If corrections agree with the previous correction more than the goal says, velocities learn more from
/// them; if less, less. If corrections agree with c, c is kept for longer. RESEARCH.md has the measurements.
class GainControl {
 public:
  /// `parameters`: the parameters in force at the start.
  GainControl(const GainGoal& goal, std::uint32_t bodies, const StreamParameters& parameters);

  /// Takes what an encoder tells its observer.
  void observe(const GainEvidence& evidence) { evidence_.add(evidence); }
  /// Call after each frame. Returns true if it changed decay and gains.
  bool after_frame(StreamParameters& parameters);

 private:
  GainGoal goal_;
  double enough_;        // number of corrections that a decision needs
  double decay_, gain_;  // E in units of 1/65536; beta
  std::uint32_t frames_ = 0;
  GainEvidence evidence_;
};

}  // namespace tandem::host
