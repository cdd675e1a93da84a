#pragma once
// The sub-steps of the predictor `rigid`: impulses along the contacts of a frame.

#include <cstddef>
#include <cstdint>

#include "sdk/core/lattice/state.hpp"

#if defined(__AVX2__) && !defined(TANDEM_CONTACT_AVX2)
#define TANDEM_CONTACT_AVX2
#endif

namespace tandem {

/// Numbers of the sub-steps of idl/PROTOCOL.md, "Rigid". Velocities, and spins times the radius of the sphere
/// around their body, are words in the solver's unit.
struct RigidSolverLaw {
  static constexpr int kFirstPasses = 6, kLaterPasses = 4;  ///< of the first sub-step, of the others
  static constexpr int kBits = 12;         ///< of a component 1 of a normal, of an arm, of a share
  static constexpr int kAcrossBits = 1;    ///< friction across the slip is this many bits less than along it
  static constexpr int kSlipBits = 4;      ///< of a unit of the speed at which bodies slide
  static constexpr int kFastSlipBits = 5;  ///< fewer where that speed is kMaxSlip or more
  static constexpr std::int32_t kMaxSlip = 1 << 13, kLeastSlip = 16;
  static constexpr int kInertiaBits = 10;  ///< of an inverse inertia of 1
  static constexpr int kInverseBits = 14;
  static constexpr std::int32_t kOne = 1 << kBits;
  static constexpr std::int32_t kMaxWord = (1 << 15) - 1;
  static constexpr std::int32_t kMaxImpulse = kMaxWord;    ///< of a contact in a sub-step
  static constexpr std::int32_t kMaxChange = kOne - 1;     ///< of it in a pass
  static constexpr std::int32_t kMaxSlide = kOne / 2 - 1;  ///< of an impulse along a tangent
  static constexpr std::int32_t kMaxStart = 3 << 13, kMaxFall = (1 << 13) - 1;  ///< of a frame
  static constexpr std::int32_t kMaxGap = 1 << 20;
  static constexpr std::int32_t kPushOut = 51;                  ///< of an overlap, in a sub-step, in 2^-8
  static constexpr std::uint32_t kPairWaves = 40, kWaves = 50;  ///< those from kPairWaves on are of walls
  static constexpr std::size_t kMaxPoints = 8;                  ///< of a pair
};

/// V of a body, 0, W, 0. Behind the last body there is a row of zeros, which stands for the static geometry.
struct alignas(16) RigidRow {
  std::int16_t v[4]{}, w[4]{};
};

/// The sums of what a row holds: of its words 0, 2, 4 and 6, and of the others.
struct alignas(32) RigidMoved {
  std::int32_t even[4]{}, odd[4]{};
};

/// Bodies while contacts are solved, by place.
struct RigidMotions {
  RigidRow* now;         ///< at the end of the last sub-step
  RigidRow* base;        ///< at the start of the sub-step, before any impulse
  RigidRow* way;         ///< moved / substeps
  const RigidRow* fall;  ///< the change in this frame without contacts
  RigidMoved* moved;     ///< sums over the sub-steps
  std::size_t rows;      ///< bodies, and one more
};

/// What contacts need of a body, by place; zeros for the static geometry.
struct alignas(32) RigidMass {
  std::int32_t inertia[6]{};  ///< inverse: xx, yy, zz, xy, yz, zx; in 2^-10, up to 2^16
  std::int32_t unused[2]{};
};

/// A point where it is found, in 2^-12: the normal, and both arms by the radius of the body.
struct alignas(32) RigidFound {
  std::int16_t arm_a[3], arm_b[3], unused[2];
  std::int16_t n[3], unused_too;
  std::int32_t gap;  ///< solver units times a frame
  std::int32_t padding;
};

/// The points of two bodies that touch, which have one wave.
struct RigidTouch {
  std::uint32_t a, b;             ///< places; n points from b to a
  std::uint32_t first;            ///< of its points
  std::uint16_t wave, count;      ///< count: 1 .. 8
  std::int16_t share_a, share_b;  ///< the change of both velocities, in 2^-12
  std::uint16_t pressing;         ///< how many of its points are likely to have an impulse
};

/// An impulse in one direction, of eight pairs. `xy` has two words in a lane, `z` one and another number.
struct alignas(32) RigidImpulse {
  std::int32_t d_xy[8], d_z[8];  ///< the direction; and 1 / (the change of the relative velocity), in 2^-14
  std::int32_t arm_a_xy[8], arm_b_xy[8], arm_z[8];     ///< arm x d; z: a's and minus b's
  std::int32_t turn_a_xy[8], turn_b_xy[8], turn_z[8];  ///< the change of both spins; z: a's and b's
  std::int32_t push[8];
};

/// A point of each of eight pairs.
struct alignas(32) RigidContact {
  std::int32_t gap[8], wanted[8];
  RigidImpulse normal, tangents[2];
};

/// Eight pairs of a wave. No body is in two of them, except bodies that they do not change.
struct alignas(32) RigidGroup {
  static constexpr std::size_t kPairs = 8;
  std::uint32_t a[kPairs], b[kPairs];  ///< places times sizeof(RigidRow)
  std::int32_t share_a[kPairs], share_b[kPairs];
  std::uint32_t first, count;  ///< of contacts
  bool alike;                  ///< all shares are 1
};

/// What holds for all contacts of a frame.
struct RigidMaterial {
  std::uint32_t substep_bits;
  std::int32_t slop;           ///< a gap up to this is none, solver's unit
  std::int32_t near;           ///< bodies of a larger gap do not feel each other
  std::int32_t friction;       ///< in 2^-12
  std::int32_t most_push_out;  ///< a speed
};

struct RigidKernels {
  /// Fills the contacts of a group from the points of its pairs; `pairs` are as many as kPairs. A pair
  /// without points has both places at the static geometry. `start` and `fall`: `now` and `fall` of
  /// RigidMotions.
  void (*put)(const RigidTouch* const* pairs, const RigidFound* found, const RigidMass* masses,
              const RigidRow* start, const RigidRow* fall, std::uint32_t substep_bits, RigidGroup& group,
              RigidContact* contacts);
  /// A frame of all bodies. `groups` are in the order of their waves.
  void (*solve)(const RigidMaterial& material, const RigidGroup* groups, std::size_t count,
                RigidContact* contacts, const RigidMotions& motions);
};

/// Kernels for any machine.
[[nodiscard]] RigidKernels portable_rigid_kernels();
#ifdef TANDEM_CONTACT_AVX2
/// Kernels with the same bits, eight pairs at a time; only if the processor has AVX2.
[[nodiscard]] RigidKernels avx2_rigid_kernels();
#endif
[[nodiscard]] RigidKernels fastest_rigid_kernels();

}  // namespace tandem
