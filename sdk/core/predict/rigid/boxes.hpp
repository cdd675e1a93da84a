#pragma once
// Where pairs of boxes touch, for 16 pairs at a time. idl/PROTOCOL.md, "Rigid", has the formulas.

#include <cstddef>
#include <cstdint>

#include "sdk/core/predict/rigid/near.hpp"

#if defined(__AVX2__) && !defined(TANDEM_CONTACT_AVX2)
#define TANDEM_CONTACT_AVX2
#endif

namespace tandem {

/// A placed solid in words. Lengths are in the unit of the frame's pairs.
struct alignas(32) RigidSolidWords {
  std::int16_t axes[3][3];  ///< in 2^-15
  std::int16_t size[3];
  std::int16_t radius, scale, inverse;  ///< (x * scale) * inverse / 2^15 is x by the radius, in 2^-12
  std::int16_t unused;
};

/// Two boxes that may touch.
struct alignas(16) RigidBoxPair {
  std::int16_t d[3], margin;  ///< b's centre minus a's; points have a gap below the margin
  std::uint16_t a, b;         ///< places
  std::uint32_t of;           ///< any number
};

/// The points of 16 pairs. Gaps are in the unit of the pairs, the rest in 2^-12.
struct alignas(32) RigidBoxPoints {
  static constexpr std::size_t kPairs = 16;
  static constexpr std::size_t kPoints = 4;  ///< of a pair, at most

  struct Pair {
    std::int16_t n[3], count;  ///< of its points
    std::int16_t unused[4];
  };
  struct Point {
    std::int16_t arm_a[3], arm_b[3], gap, unused;
  };
  Pair pairs[kPairs];
  Point points[kPoints][kPairs];
};

struct RigidPairKernels {
  /// Moves those pairs to the front that no face keeps apart, and returns how many. `count`: a multiple of
  /// kPairs.
  std::size_t (*keep_near)(RigidBoxPair* pairs, std::size_t count, const RigidSolidWords* solids);
  /// Fills `points` for kPairs pairs; `solids` by place.
  void (*touch_boxes)(const RigidBoxPair* pairs, const RigidSolidWords* solids, RigidBoxPoints& points);
  RigidFindNear find_near;
};

/// For any machine.
[[nodiscard]] RigidPairKernels portable_rigid_pair_kernels();
#ifdef TANDEM_CONTACT_AVX2
/// The same bits; only if the processor has AVX2.
[[nodiscard]] RigidPairKernels avx2_rigid_pair_kernels();
#endif
[[nodiscard]] RigidPairKernels fastest_rigid_pair_kernels();

}  // namespace tandem
