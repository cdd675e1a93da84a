#pragma once
// What goes wrong with engines in processes of their own.

#include <cstdint>

#include "tests/fault/world/faults/plan.hpp"

namespace tandem::world {

/// Faults of engines alone. They are drawn apart from the others, so that a seed's other faults are the same
/// with and without them.
[[nodiscard]] bool of_an_engine(FaultKind kind);
/// Adds such faults to the plan of a world whose engines are processes, as far as they are wished for.
void add_engine_faults(std::uint64_t seed, const PlanWishes& wishes, Plan& plan);

}  // namespace tandem::world
