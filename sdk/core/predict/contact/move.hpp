#pragma once
// How a sub-step of the tier `contact` moves bodies.

#include <cstdint>
#include <span>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

struct ContactMove {
  std::uint32_t shift;  ///< a grid unit is 2^shift lattice units
  std::int32_t substeps;
  Vec3i gravity;
  std::uint32_t damping;
  std::span<const std::uint8_t> at_rest;  ///< by slot, bodies that do not move; empty: none
  const State* accelerated;               ///< whose c is added to v; null: none
  std::uint16_t decay;                    ///< of c, in 1/65536
};

/// Where bodies are when a frame starts, for the search of pairs: columns of ContactGrid, by place.
struct ContactPlaces {
  std::uint32_t shift, near_shift;           ///< of lattice units: to grid units, to those of the search
  std::int32_t later_share;                  ///< of v, in 1/32768, that moves a body up to the last sub-step
  std::span<std::uint32_t> xy, later_xy, z;  ///< later_xy: none for one sub-step
};

/// Writes these and what others see of bodies that have not moved yet; no force acts on them.
void place_bodies(std::span<const ContactBody> bodies, const ContactPlaces& places,
                  std::span<ContactView> views, std::span<ContactForce> forces);

/// A sub-step that others follow: moves bodies by the forces on them, which go back to 0, and writes what
/// others see of them.
void move_bodies(const ContactMove& move, std::span<ContactBody> bodies, std::span<ContactForce> forces,
                 std::span<ContactView> views);

/// The last sub-step: moves bodies into p and v of `to`, whose `alive` holds already, and lets c decay into
/// its c, `from` and `to` may be the same. `place`: by slot, of dead ones any.
void move_bodies(const ContactMove& move, std::span<const ContactBody> bodies,
                 std::span<const ContactForce> forces, std::span<const std::uint32_t> place,
                 const State& from, State& to);

}  // namespace tandem
