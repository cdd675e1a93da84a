#pragma once
// What one frame of a stream may take.

#include <cstddef>

#include "sdk/core/codec/codec.hpp"

namespace tandem::host {

/// Bytes of payload. Spawns and parameters are told whatever they take; corrections are held back.
struct FrameBudget {
  std::size_t most = kNoBudget;  ///< the frame's maximum
  std::size_t fair = 0;  ///< what a frame may take if all are alike; the threshold is chosen for it. 0: it is
                         ///< not chosen for a cap
};

}  // namespace tandem::host
