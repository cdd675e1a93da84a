#pragma once
// How a sub-step of the tier `contact` moves bodies.

#include <cstdint>
#include <span>

#include "sdk/core/predict/contact_pairs.hpp"

namespace tandem {

struct ContactMove {
  std::uint32_t force_shift;  ///< forces times 2^force_shift are changes of v
  bool one_mobility;          ///< the mobility of all bodies is 65536
  std::int32_t substeps;
  Vec3i gravity;
  std::uint32_t damping;
};

/// Moves bodies by the forces on them and takes those back to 0. `accelerations`, by place: none or all.
void move_bodies(const ContactMove& move, std::span<ContactBody> bodies, std::span<ContactForce> forces,
                 std::span<const ContactForce> accelerations);

}  // namespace tandem
