#pragma once
// How a sub-step of the tier `contact` moves bodies.

#include <cstdint>
#include <span>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

struct ContactMove {
  std::uint32_t shift;  ///< a grid unit is 2^shift lattice units
  bool one_mobility;    ///< the mobility of all bodies is 65536
  std::int32_t substeps;
  Vec3i gravity;
  std::uint32_t damping;
  std::span<const std::uint8_t> at_rest;  ///< by place, bodies that do not move; empty: none
};

/// Moves bodies by the forces on them, which go back to 0, and writes what others see of them.
/// `accelerations`, by place: none or all.
void move_bodies(const ContactMove& move, std::span<ContactBody> bodies, std::span<ContactForce> forces,
                 std::span<const ContactForce> accelerations, std::span<ContactView> views);

/// Where bodies are when a frame starts, for the search of pairs: columns of ContactGrid, by place.
struct ContactPlaces {
  std::uint32_t shift, near_shift;  ///< of lattice units: to grid units, to those of the search
  std::int32_t later_share;         ///< of v, in 1/32768, that moves a body up to the last sub-step
  std::span<std::uint32_t> xy, later_xy, z;
};

/// Writes these and what others see of bodies that have not moved yet.
void place_bodies(std::span<const ContactBody> bodies, const ContactPlaces& places,
                  std::span<ContactView> views);

}  // namespace tandem
