#pragma once
// Moves bodies in a sub-step of the predictors `contact` and `field`.

#include <cstdint>
#include <span>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

struct ContactMove {
  std::uint32_t shift;  ///< a grid unit is 2^shift lattice units
  std::int32_t substeps;
  Vec3i gravity;
  std::uint32_t damping;
  std::span<const std::uint8_t> at_rest;  ///< by slot: 1 for bodies that do not move
  const State* accelerated;               ///< state whose c is added to v; null: none
  std::uint16_t decay;                    ///< decay of c, in 1/65536
};

/// The places of bodies at the start of a frame, for the search of pairs: columns of ContactGrid, by place.
struct ContactPlaces {
  std::uint32_t shift, near_shift;   ///< shifts from lattice units to grid units and to units of the search
  std::int32_t later_share;          ///< share of v, in 1/32768, that moves a body up to the last sub-step
  std::uint32_t *xy, *later_xy, *z;  ///< later_xy is null for one sub-step
};

/// Writes these columns, and the view of each body and its force to its touch. The k-th body has the place
/// at[k].
void place_bodies(std::span<const ContactBody> bodies, const std::uint32_t* at,
                  std::span<const ContactForce> forces, const ContactPlaces& places, ContactTouch* touches);

/// True if a body in these slots moves: it is not at rest in `to`.
[[nodiscard]] bool any_moves(const State& from, const State& to, Slot first, std::uint32_t count);

/// Copies p, v and c of slots.
void copy_motion(const State& from, State& to, Slot first, std::uint32_t count);

/// A sub-step that is not the last: moves bodies by the forces on them, sets the forces back to 0, and writes
/// the bodies' views.
void move_bodies(const ContactMove& move, std::span<ContactBody> bodies, ContactTouch* touches);

/// The last sub-step: moves the bodies in `count` slots (at most BlockLedger::kRunSlots) from `first` on into
/// p and v of `to`, and writes the decayed c. `from` and `to` may be the same. `bodies`, by place, is not
/// read if there is one sub-step. `place`: by slot; any value for dead ones and for those at rest.
void move_slots(const ContactMove& move, std::span<const ContactBody> bodies, const ContactTouch* touches,
                std::span<const std::uint32_t> place, Slot first, std::uint32_t count, const State& from,
                State& to);

}  // namespace tandem
