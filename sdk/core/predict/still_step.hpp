#pragma once
// What predictors with contacts, whose bodies sleep, have in common: `hard` and `rigid`.

#include <cstdint>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// A body that has been calm for so many frames sleeps.
inline constexpr std::uint8_t kCalmFrames = 5;

/// True if gravity has changed by more than a fiftieth of its largest component, which wakes bodies.
[[nodiscard]] bool has_turned(const Vec3i& before, const Vec3i& now);

/// Remembers a step that changed nothing, so that it need not be computed again. It sees the predictor's byte
/// of each body, and the columns of the groups that the predictor moves.
class StillStep {
 public:
  StillStep(std::uint32_t capacity, const Groups& moved);

  /// True if this state and input are those of the step that was remembered last.
  [[nodiscard]] bool is(const State& from, const StepInput& input) const;
  void forget() { known_ = false; }
  void remember(const State& state, const StepInput& input);

  /// Copies what no step moves, and clears dead slots. The two may be the same state, as below.
  void copy_unmoved(const State& from, State& to) const;
  /// Makes the step that was remembered.
  void repeat(const State& from, State& to) const;

 private:
  State state_;
  StepInput input_;
  bool known_ = false;
};

}  // namespace tandem
