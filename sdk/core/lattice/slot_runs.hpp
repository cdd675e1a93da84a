#pragma once
// Operations on runs of slots, such as a block, instead of whole states.

#include <cstdint>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Copies all columns of slots first .. first + count - 1. Both states are of one timeline, so they have the
/// same columns.
void copy_slots(const State& from, State& to, Slot first, std::uint32_t count);

/// As step_groups(from, to), for slots first .. first + count - 1 only.
void step_groups(const State& from, State& to, Slot first, std::uint32_t count);

}  // namespace tandem
