#pragma once
// Pairs of the predictors `contact` and `field`: finds the bodies that are near each other at the start of a
// frame, and adds the forces between them.

#include <array>
#include <cstdint>
#include <limits>

#include "sdk/core/lattice/state.hpp"

#if defined(__AVX2__) && !defined(TANDEM_CONTACT_AVX2)
#define TANDEM_CONTACT_AVX2
#endif

namespace tandem {

/// A body during the steps of a frame: half a cache line.
struct alignas(32) ContactBody {
  Vec3i p;
  std::int32_t radius;
  Vec3i v;
  Slot slot;
};

/// The part of a body that other bodies see. Differences may wrap, because bodies far apart do not matter.
struct alignas(16) ContactView {
  std::array<std::int16_t, 3> q;  ///< p in grid units, the lower 16 bits
  std::int16_t radius;            ///< grid units
  std::array<std::int16_t, 3> v;  ///< grid units per frame, limited
  std::int16_t unused;
};

/// The changes of v, in 1/16 grid unit per frame. They are 0 between two sub-steps.
struct alignas(16) ContactForce {
  Vec3i f;
  std::int32_t mobility;  ///< mobility of the body
};

/// A body while pairs push it: as large as a ContactBody, and half a cache line too.
struct alignas(32) ContactTouch {
  ContactView view;
  ContactForce force;
};
static_assert(sizeof(ContactTouch) == sizeof(ContactBody));

/// How cells are numbered: x + (y << row) + (z << layer), of which the lowest `all` bits count. At least four
/// cells a row, rows a layer and layers; otherwise the cells before and behind one would be the same.
struct ContactCellBits {
  std::uint32_t row = 0, layer = 0, all = 0;
  friend bool operator==(const ContactCellBits&, const ContactCellBits&) = default;
};

/// The torus of cells, with the bodies that take part sorted by cell.
struct ContactGrid {
  static constexpr std::uint32_t kMaxInCell = 16;

  ContactCellBits bits;
  const std::uint32_t* begin = nullptr;  ///< by cell, and one more: the place of its first body
  const std::uint32_t* cell = nullptr;   ///< by place
  // By place, each coordinate in 16 bits of 2^5 grid units. The arrays are readable for 8 more elements.
  const std::uint32_t* xy = nullptr;  ///< x in the lower half, y in the upper
  /// Where the last sub-step finds the body if nothing pushes it; null for one sub-step.
  const std::uint32_t* later_xy = nullptr;
  const std::uint32_t* z = nullptr;  ///< lower half: now; upper half: later, or 0
  std::uint32_t near_squared = 0;    ///< bodies nearer than this, now or later, are a pair
  /// The place at which the search ends, if that is not the last one.
  std::uint32_t end = std::numeric_limits<std::uint32_t>::max();
};

/// The places of the two bodies of each pair; the body whose cell is behind comes first.
struct ContactPairs {
  std::uint32_t* first;
  std::uint32_t* second;
  std::uint32_t count;

  /// Number of pairs whose forces are added at a time. A pair of a body and itself adds nothing.
  static constexpr std::uint32_t kBatch = 512;
  /// Maximum number of pairs that may be found beyond `enough`, including what a vector writes beyond its
  /// end.
  static constexpr std::uint32_t kMaxAtOnce = 14 * ContactGrid::kMaxInCell + 16;
};

/// The constants of a contact's force. Gains as in ContactMaterial.
struct ContactLaw {
  std::int32_t spring, drag, shear;  ///< drag: damping + shear
  std::uint32_t shift;               ///< a grid unit is 2^shift lattice units
};

struct ContactKernels {
  /// Appends the pairs of the bodies from `place` on until there are `enough`. There is room for kMaxAtOnce
  /// more. Returns the place of the first body that was not examined.
  std::uint32_t (*find)(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough,
                        ContactPairs& pairs);
  /// Adds the forces of all pairs, in whole batches. `inverse_root`: 2^30 / r by r^2 >> 16.
  void (*add_forces)(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactPairs& pairs,
                     ContactTouch* touches);
};

/// Kernels in plain integers, for any machine.
[[nodiscard]] ContactKernels portable_contact_kernels();
#ifdef TANDEM_CONTACT_AVX2
/// Kernels with the same bits, eight at a time; only if the processor has AVX2.
[[nodiscard]] ContactKernels avx2_contact_kernels();
#endif
[[nodiscard]] ContactKernels fastest_contact_kernels();

}  // namespace tandem
