#pragma once
// The parts of a timeline of either side.

#include <memory>

#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

struct TimelineParts {
  std::unique_ptr<Predictor> predictor;
  DeltaCodec delta;
  RunBlocks run_blocks;
  StateHasher hasher;

  /// The hash of a state right after the delta codec has applied to it.
  [[nodiscard]] std::uint64_t hash(const State& state) {
    return hasher.hash(state, {.codec = delta.codec().columns(), .predictor = std::as_bytes(state.own())},
                       run_blocks);
  }
  /// The input of the next step.
  [[nodiscard]] StepInput step_input(const Drive& drive, const Vec3i& gravity_before) const {
    const StreamParameters& in_force = delta.parameters();
    return {drive, in_force.step, in_force.codec.threshold, gravity_before};
  }
};

/// Checks `layout` and makes its codec. Errors: kUnsupported, kMalformed, kInvalidArgument.
[[nodiscard]] Result<TimelineParts> make_parts(const Layout& layout, const LocalOptions& local,
                                               std::unique_ptr<Predictor> predictor);

}  // namespace tandem
