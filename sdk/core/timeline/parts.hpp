#pragma once
// What a timeline of either side is made of.

#include <memory>

#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

struct TimelineParts {
  std::unique_ptr<Predictor> predictor;
  DeltaCodec delta;
};

/// Checks `layout` and makes its codec. Errors: kUnsupported, kMalformed, kInvalidArgument.
[[nodiscard]] Result<TimelineParts> make_parts(const Layout& layout, const LocalOptions& local,
                                               std::unique_ptr<Predictor> predictor);

}  // namespace tandem
