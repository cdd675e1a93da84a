#pragma once
// Removes the faults that a finding does not need.

#include <functional>
#include <string>

#include "tests/fault/world/world.hpp"

namespace tandem::world {

/// Delta debugging (Zeller, Hildebrandt 2002) over the faults of a plan: the smallest plan found with which
/// `run` still breaks the rule `invariant`. No fault of it can be left out alone.
[[nodiscard]] Plan shrink(Plan plan, const std::string& invariant,
                          const std::function<Outcome(const Plan&)>& run);

}  // namespace tandem::world
