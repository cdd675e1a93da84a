#pragma once
// Automatic quality chooses what the decoder reads (threshold, quantisation ranges) at run time. The thesis,
// section 6, names it as future work. The choice travels in the deltas; clients need no configuration.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "services/host/streams/frame_budget.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "services/host/streams/residual_statistics.hpp"

namespace tandem::host {

/// The limits of automatic quality.
struct QualityGoal {
  /// Payload rate at the nominal frame rate; 0: the threshold stays, only ranges follow.
  double target_mbit_per_s = 0;
  std::int32_t smallest_threshold = 1;  ///< lattice units; the threshold is never smaller, even far below the
                                        ///< target
  std::int32_t largest_threshold = 1;   ///< the stated maximum error; the threshold is never larger, even
                                        ///< above the target
  bool operator==(const QualityGoal&) const = default;
};

/// By default automatic quality moves between these multiples of the stated threshold.
inline constexpr double kFinestShare = 0.25, kCoarsestShare = 4;
/// Under a cap the threshold may be so much coarser, as else corrections wait.
inline constexpr double kCoarsestShareOfCap = 64;

/// The goal from thresholds in scene units, rounded and clamped to the lattice.
[[nodiscard]] QualityGoal quality_goal(const Lattice& lattice, double target_mbit_per_s, double finest,
                                       double coarsest);

/// How quantisation steps follow what is corrected.
enum class StepRule : std::uint8_t {
  kLeave,        ///< the codec does not read them
  kFollow,       ///< steps follow up and down
  kFollowAbove,  ///< steps never fall below those of the start, because the code tables were trained for them
};
[[nodiscard]] StepRule step_rule(const CodecTraits& traits);

/// True if the limits are in order and permit `parameters`.
[[nodiscard]] bool valid_goal(const QualityGoal& goal, const CodecParameters& parameters);
/// Minimum budget, in bytes per frame, with which the target can be reached. A smaller budget would hold the
/// rate below the target, which would look like room for a finer threshold. 0 without a target.
[[nodiscard]] std::size_t least_budget(const QualityGoal& goal, double frame_rate_hz);

/// Observes every frame and decides four times a second. Deterministic; reads no clock. Not thread-safe.
class QualityControl {
 public:
  /// `start`: the parameters of the first frame, which has `bodies` bodies. `radii`: Layout::radii.
  QualityControl(const QualityGoal& goal, StepRule steps, const CodecParameters& start, std::uint32_t bodies,
                 double frame_rate_hz, std::vector<std::int32_t> radii = {});

  /// Takes what an encoder tells its observer.
  void observe(const State& predicted, const State& target, const CodecParameters& parameters) {
    if (steps_ != StepRule::kLeave) statistics_.frame(predicted, target, parameters);
  }
  /// Call after each frame. Returns true if it changed threshold or steps. The goal must be valid for
  /// `parameters`, which are those of the next frame.
  /// `budget`: under a cap the frame's own, which is then the goal in place of a target.
  bool after_frame(std::size_t payload_bytes, std::uint32_t corrected, CodecParameters& parameters,
                   const FrameBudget& budget = {});
  /// True if the rate was above the target, or a cap held corrections back, for two seconds although the
  /// threshold is at its maximum; false again after two seconds of the contrary.
  [[nodiscard]] bool out_of_reach() const { return out_of_reach_; }

 private:
  [[nodiscard]] double ratio() const;
  [[nodiscard]] bool has_goal() const { return goal_.target_mbit_per_s > 0 || fair_bytes_ > 0; }
  [[nodiscard]] std::int32_t next_threshold(std::int32_t threshold) const;
  [[nodiscard]] CodecParameters with_steps(CodecParameters parameters) const;
  void judge(std::int32_t threshold);

  QualityGoal goal_;
  std::vector<std::int32_t> radii_;
  StepRule steps_;
  CodecParameters start_;
  std::uint32_t bodies_;
  double frame_rate_hz_;
  std::uint32_t frames_per_decision_;
  std::uint32_t frames_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t corrected_ = 0;
  std::uint64_t fair_bytes_ = 0;  // FrameBudget::fair
  std::uint32_t full_ = 0;        // frames that took all that their budget permits
  int pressed_ = 0;               // decisions above the target at the maximum threshold, minus the others
  bool out_of_reach_ = false;
  ResidualStatistics statistics_;
};

}  // namespace tandem::host
