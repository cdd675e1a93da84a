#pragma once
// What the predicted step reads besides the state. Changes by scheduled input only, never by a delta.

#include <cstdint>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Integers of the predicted step, converted once by the server from scene units.
struct Drive {
  Vec3i gravity{};            ///< 1/64 lattice unit per frame^2, |g| <= 2^28
  std::uint16_t damping = 0;  ///< D: share of v lost per frame, in 1/65536
  std::uint16_t decay = 0;    ///< E: share of c lost per frame, in 1/65536; 0 for the paper's codecs
  friend bool operator==(const Drive&, const Drive&) = default;
};

}  // namespace tandem
