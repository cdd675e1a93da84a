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
  std::span<const std::uint8_t> at_rest;  ///< by slot: 1 for bodies that do not move; empty: there are none
  const State* accelerated;               ///< state whose c is added to v; null: none
  std::uint16_t decay;                    ///< decay of c, in 1/65536
};

/// The places of bodies at the start of a frame, for the search of pairs: columns of ContactGrid, by place.
struct ContactPlaces {
  std::uint32_t shift, near_shift;           ///< shifts from lattice units to grid units and to units of the
                                             ///< search
  std::int32_t later_share;                  ///< share of v, in 1/32768, that moves a body up to the last
                                             ///< sub-step
  std::span<std::uint32_t> xy, later_xy, z;  ///< later_xy is empty for one sub-step
};

/// Writes these columns and the views of bodies that have not moved yet. Sets their forces to zero.
void place_bodies(std::span<const ContactBody> bodies, const ContactPlaces& places,
                  std::span<ContactView> views, std::span<ContactForce> forces);

/// A sub-step that is not the last: moves bodies by the forces on them, sets the forces back to 0, and writes
/// the bodies' views.
void move_bodies(const ContactMove& move, std::span<ContactBody> bodies, std::span<ContactForce> forces,
                 std::span<ContactView> views);

/// The last sub-step: moves bodies into p and v of `to`, whose `alive` is already set, and writes the decayed
/// c. `from` and `to` may be the same. `place`: by slot; any value for dead ones.
void move_bodies(const ContactMove& move, std::span<const ContactBody> bodies,
                 std::span<const ContactForce> forces, std::span<const std::uint32_t> place,
                 const State& from, State& to);

}  // namespace tandem
