#pragma once
// Bodies that are all far from the origin, as places on a map are.

#include <string>

#include "tandem/simulation.hpp"

namespace tandem::host {

/// What to say behind a line about hidden bodies if all are beyond the extent, but close together: which
/// origin to subtract. Otherwise empty. O(bodies).
[[nodiscard]] std::string origin_hint(const engine::Bodies& bodies, double extent);

}  // namespace tandem::host
