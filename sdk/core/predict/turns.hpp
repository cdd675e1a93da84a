#pragma once
// Orientations in a predicted step: the one rule that all tiers share. idl/PROTOCOL.md, "Turn".

#include <span>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// After the step has written to.rest(): turns every body that is not at rest by its angular velocity, which
/// stays. Nothing in a stream without orientations. `from` and `to` may be the same object.
void turn_bodies(const State& from, State& to);
/// The same for the listed slots only.
void turn_bodies(const State& from, State& to, std::span<const Slot> slots);

}  // namespace tandem
