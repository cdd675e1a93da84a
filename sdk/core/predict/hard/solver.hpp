#pragma once
// The passes over contacts of the predictor `hard`.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/core/lattice/state.hpp"

#if defined(__AVX2__) && !defined(TANDEM_CONTACT_AVX2)
#define TANDEM_CONTACT_AVX2
#endif

namespace tandem {

/// Numbers of idl/PROTOCOL.md, "Hard". Velocities are words in the solver's unit, in which the threshold a
/// frame is 2^9 to 2^10 - 1. Sums of words stay within 16 bits.
struct HardLaw {
  static constexpr std::int32_t kSubsteps = 4;
  static constexpr std::int32_t kFirstPasses = 3, kLaterPasses = 2;  ///< of the first sub-step, of the others
  static constexpr std::int32_t kOne = 1 << 12;                      ///< a component 1 of a unit vector
  static constexpr std::int32_t kMaxWord = (1 << 15) - 1;            ///< of all that is a word
  static constexpr std::int32_t kWhole = 1 << 15;                    ///< a share of 1; kMaxWord stands for it
  static constexpr std::int32_t kHalf = kWhole / 2;  ///< the share of bodies that weigh the same
  static constexpr std::int32_t kMaxStart = 3 << 13, kMaxFall = (1 << 13) - 1;  ///< of a frame
  /// The speed by which bodies that overlap leave each other: 0.2 of the overlap in a sub-step, in 2^-15 of
  /// it a frame. With less the pile sinks, with more it trembles.
  static constexpr std::int16_t kPushOut = 26240;
  static constexpr std::int16_t kMaxPushOut = 1 << 9;
  static constexpr std::uint32_t kPairWaves = 20, kWaves = 26;  ///< those from kPairWaves on are of walls
};

/// Three components and a 0.
struct alignas(8) HardRow {
  std::array<std::int16_t, 4> of{};
};

/// Bodies while contacts are solved, by place. Behind the last of them there is a row of zeros, which stands
/// for the static geometry. There is room for kBeyond more rows.
struct HardMotions {
  static constexpr std::size_t kBeyond = 3;

  HardRow* w;     ///< velocity
  HardRow* base;  ///< w at the start of the sub-step, before any impulse
  HardRow* way;   ///< how far moved in this frame before the sub-step
  /// Four times the way moved in the frame: x and z of each body, and y and 0. The sums of even and of odd
  /// words of the rows are computed apart.
  std::int32_t *moved_xz, *moved_y;
  const HardRow* fall;  ///< the change of w in this frame without contacts
  std::size_t rows;     ///< bodies, and one more
};

/// A contact when it is found. Its bodies are given by place; n points from b to a.
struct alignas(32) HardContact {
  std::uint32_t a, b;
  Vec3i n;
  std::int32_t gap;                     ///< solver units times a frame
  std::array<std::int16_t, 2> share{};  ///< a's and b's part of what the contact changes
  std::uint32_t run;                    ///< see HardContacts
};

/// Sixteen contacts of a wave. No body is in two of them, except bodies that they do not change. The passes
/// read all groups again and again, so they are small; what a pass needs where nothing pushes comes first.
/// t1 and t2 are tangents, whose other components follow from n and these: t1z = -nx, t2x = t1y, t2z = -ny.
struct alignas(32) HardGroup {
  static constexpr std::size_t kContacts = 16;
  std::uint32_t a[kContacts], b[kContacts];  ///< the place of the bodies times sizeof(HardRow)
  std::int16_t nx[kContacts], ny[kContacts], nz[kContacts];  ///< in 2^-15, as tangents and shares
  std::int16_t wanted[kContacts], push[kContacts];
  std::int16_t gap[kContacts];
  std::int16_t t1x[kContacts], t1y[kContacts], t2y[kContacts];
  std::int16_t slide1[kContacts], slide2[kContacts];
  std::int16_t share_a[kContacts], share_b[kContacts];
  bool alike;  ///< all shares are a half
};

struct HardMaterial {
  std::int16_t slop;      ///< a gap up to this is none, solver units times a frame
  std::int16_t friction;  ///< in 2^-15
};

struct HardKernels {
  /// Writes contacts into groups, sixteen after sixteen: those at `order` of `contacts`. Their impulses are
  /// 0.
  void (*put)(const HardContact* contacts, const std::uint32_t* order, HardGroup* groups, std::size_t count);
  /// A frame of all bodies: four sub-steps, and a last pass that takes back what pushing out has left in w.
  /// `groups` are in the order of their waves.
  void (*solve)(const HardMaterial& material, HardGroup* groups, std::size_t count,
                const HardMotions& motions);
};

/// Kernels in plain integers, for any machine.
[[nodiscard]] HardKernels portable_hard_kernels();
#ifdef TANDEM_CONTACT_AVX2
/// Kernels with the same bits, sixteen contacts at a time; only if the processor has AVX2.
[[nodiscard]] HardKernels avx2_hard_kernels();
#endif
[[nodiscard]] HardKernels fastest_hard_kernels();

}  // namespace tandem
