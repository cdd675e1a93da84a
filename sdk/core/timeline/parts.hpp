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

  /// The hash of a state right after the delta codec has applied to it. No predictor has columns of its own
  /// yet.
  [[nodiscard]] std::uint64_t hash(const State& state) {
    return hasher.hash(state, {.codec = delta.codec().columns(), .predictor = {}}, run_blocks);
  }
};

/// Checks `layout` and makes its codec. Errors: kUnsupported, kMalformed, kInvalidArgument.
[[nodiscard]] Result<TimelineParts> make_parts(const Layout& layout, const LocalOptions& local,
                                               std::unique_ptr<Predictor> predictor);

}  // namespace tandem
