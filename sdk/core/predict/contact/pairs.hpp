#pragma once
// Pairs of the tier `contact`: who is near whom at the start of a frame, and the forces between them.

#include <array>
#include <cstdint>

#include "sdk/core/lattice/state.hpp"

#if defined(__AVX2__) && !defined(TANDEM_CONTACT_AVX2)
#define TANDEM_CONTACT_AVX2
#endif

namespace tandem {

/// A body while a frame is stepped: half a cache line.
struct alignas(32) ContactBody {
  Vec3i p;
  std::int32_t radius;
  Vec3i v;
  Slot slot;
};

/// What other bodies see of one. Differences wrap, as places far apart do not matter.
struct alignas(16) ContactView {
  std::array<std::int16_t, 3> q;  ///< p in grid units, the lower 16 bits
  std::int16_t radius;            ///< grid units
  std::array<std::int16_t, 3> v;  ///< grid units per frame, limited
  std::int16_t unused;
};

/// Changes of v, in 1/16 grid unit per frame. 0 between two sub-steps.
struct alignas(16) ContactForce {
  Vec3i f;
  std::int32_t mobility;  ///< of the body
};

/// The torus of cells, with the bodies that take part sorted by cell.
struct ContactGrid {
  static constexpr std::uint32_t kMostInCell = 16;

  std::uint32_t side_bits;     ///< 2^side_bits cells a side, x lowest in a cell's number
  const std::uint32_t* begin;  ///< by cell, and one more: places of its bodies
  const std::uint32_t* cell;   ///< by place
  // By place, each coordinate in 16 bits of 2^5 grid units; readable 8 further.
  const std::uint32_t* xy;  ///< x below, y above
  /// Where the last sub-step finds it if nothing pushes it; none for one sub-step.
  const std::uint32_t* later_xy;
  const std::uint32_t* z;      ///< now below, later or 0 above
  std::uint32_t near_squared;  ///< bodies nearer than this, now or later, are a pair
};

/// Places of the two bodies of each pair, the one whose cell lies behind first.
struct ContactPairs {
  std::uint32_t* first;
  std::uint32_t* second;
  std::uint32_t count;

  /// Forces are added to so many at a time. A body and itself are a pair that adds nothing.
  static constexpr std::uint32_t kBatch = 512;
  /// How many more than enough may be found, and what a vector writes beyond.
  static constexpr std::uint32_t kMostAtOnce = 14 * ContactGrid::kMostInCell + 16;
};

/// What a contact does, besides where it is. Gains as in ContactMaterial.
struct ContactLaw {
  std::int32_t spring, drag, shear;  ///< drag: damping and shear
  std::uint32_t shift;               ///< a grid unit is 2^shift lattice units
};

struct ContactKernels {
  /// Appends the pairs of the bodies from `place` on until they are `enough`; there is room for kMostAtOnce
  /// more. Returns the place of the first body not looked at.
  std::uint32_t (*find)(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough,
                        ContactPairs& pairs);
  /// Adds the forces of all pairs, whole batches. `inverse_root`: 2^30 / r by r^2 >> 16.
  void (*add_forces)(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactView* views,
                     const ContactPairs& pairs, ContactForce* forces);
};

/// Plain integers, for any machine.
[[nodiscard]] ContactKernels portable_contact_kernels();
#ifdef TANDEM_CONTACT_AVX2
/// The same bits, eight at a time; only where the processor has AVX2.
[[nodiscard]] ContactKernels avx2_contact_kernels();
#endif
[[nodiscard]] ContactKernels fastest_contact_kernels();

}  // namespace tandem
