#pragma once
// When what is learned from corrections is enough for a decision.

#include <algorithm>
#include <cstdint>

namespace tandem::host {

inline constexpr std::uint32_t kFramesPerDecision = 15;

/// Number of corrections that a decision needs: of a fifth of the bodies, and at least a hundred.
constexpr double enough_corrections(double bodies) { return std::max(100.0, 0.2 * bodies); }

}  // namespace tandem::host
