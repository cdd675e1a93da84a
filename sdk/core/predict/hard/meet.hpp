#pragma once
// Finds out which pairs touch, for the predictor `hard`.

#include <cstdint>

#include "sdk/core/predict/contact/pairs.hpp"
#include "sdk/core/predict/hard/solver.hpp"

namespace tandem {

/// The lengths and the unit of a frame that decide about contacts.
struct HardReach {
  std::uint32_t shift;  ///< a unit of the solver is 2^shift / 64 lattice units; at most 27
  std::int32_t reach;   ///< lattice units: nearer bodies, and those about to come nearer, touch
  std::int64_t met;     ///< 1/64 lattice unit: bodies that do not come as near will hardly push each other
  std::int32_t wall;    ///< lattice units, added to radii towards the static geometry
  std::int32_t largest_radius;
};

/// Bodies by place.
struct HardBodies {
  const ContactBody* bodies;
  const std::int32_t* mobility;  ///< 0: contacts do not change it
  bool any_fixed;                ///< there may be such bodies
};

/// Sets n, gap and run. Returns whether bodies that are `gap` lattice units apart along n, with the relative
/// velocity u, touch in this frame.
bool hard_touches(const HardReach& reach, std::int64_t gap, const Vec3i& n, const Vec3i& u,
                  HardContact& contact);

/// Writes the contacts of pairs that touch, in their order, and returns their number; a share is not set, and
/// the wave of a run is 0. May read and write 8 pairs behind them, and 4 contacts behind those found.
using HardMeet = std::uint32_t (*)(const HardReach& reach, const HardBodies& of, const ContactPairs& pairs,
                                   HardContact* found);

/// One by one, on any machine.
[[nodiscard]] HardMeet portable_hard_meet();
#ifdef TANDEM_CONTACT_AVX2
/// With the same bits, four pairs at a time; only if the processor has AVX2.
[[nodiscard]] HardMeet avx2_hard_meet();
#endif
[[nodiscard]] HardMeet fastest_hard_meet();

}  // namespace tandem
