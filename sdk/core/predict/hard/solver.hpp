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

/// Numbers of idl/PROTOCOL.md, "Hard". Velocities are in the solver's unit, in which the threshold a frame is
/// 2^10 to 2^11 - 1; so everything fits 32 bits.
struct HardLaw {
  static constexpr std::int32_t kSubsteps = 4;
  static constexpr std::int32_t kFirstPasses = 3, kLaterPasses = 2;  ///< of the first sub-step, of the others
  static constexpr std::int32_t kOne = 1 << 12;          ///< a component 1 of a unit vector, a share of 1
  static constexpr std::int32_t kMostSpeed = 1 << 16;    ///< of a body
  static constexpr std::int32_t kMostFall = 1 << 14;     ///< in a frame
  static constexpr std::int32_t kMostImpulse = 1 << 16;  ///< of a contact in a sub-step
  static constexpr std::int32_t kMostGap = 1 << 15;
  /// The speed by which bodies that overlap leave each other: 0.2 of the overlap in a sub-step, in 2^-8 of it
  /// a frame. With less the pile sinks, with more it trembles.
  static constexpr std::int32_t kPushOut = 205;
  static constexpr std::int32_t kMostPushOut = 1 << 10;
  static constexpr std::uint32_t kPairWaves = 20, kWaves = 26;  ///< those from kPairWaves on are of walls
};

/// Three components and padding.
struct alignas(16) HardRow {
  std::array<std::int32_t, 4> of{};
};

/// Bodies while contacts are solved, by place. Behind the last of them there is a row of zeros, which stands
/// for the static geometry.
struct HardMotions {
  HardRow* w;           ///< velocity
  HardRow* moved;       ///< four times the way moved in this frame
  const HardRow* fall;  ///< the change of w in this frame without contacts
  std::size_t rows;     ///< bodies, and one more
};

/// A contact when it is found. Its bodies are given by place; n points from b to a.
struct alignas(32) HardContact {
  std::uint32_t a, b;
  Vec3i n;
  std::int32_t gap;    ///< solver units times a frame
  std::int32_t share;  ///< a's part of what the contact changes
  std::uint32_t run;   ///< see HardContacts
};

/// Eight contacts of a wave. No body is in two of them, except bodies that they do not change. The passes
/// read all groups again and again, so they are small; t1 and t2 are tangents, whose other components follow
/// from n and these: t1z = -nx, t2x = sign t1y, t2z = -sign ny, with the sign of nz.
struct alignas(32) HardGroup {
  static constexpr std::size_t kContacts = 8;
  std::uint32_t a[kContacts], b[kContacts];  ///< the place of the bodies times sizeof(HardRow)
  std::int16_t nx[kContacts], ny[kContacts], nz[kContacts];
  std::int16_t t1x[kContacts], t1y[kContacts], t2y[kContacts];
  std::int16_t share[kContacts], unused[kContacts];
  std::int32_t gap[kContacts], wanted[kContacts];
  std::int32_t push[kContacts], slide1[kContacts], slide2[kContacts];
};

struct HardMaterial {
  std::int32_t slop;      ///< a gap up to this is none, solver units times a frame
  std::int32_t friction;  ///< in 2^-12
};

struct HardKernels {
  /// Writes contacts into groups, eight after eight: those at `order` of `contacts`. Their impulses are 0.
  void (*put)(const HardContact* contacts, const std::uint32_t* order, HardGroup* groups, std::size_t count);
  /// A frame of all bodies: four sub-steps, and a last pass that takes back what pushing out has left in w.
  /// `groups` are in the order of their waves.
  void (*solve)(const HardMaterial& material, HardGroup* groups, std::size_t count,
                const HardMotions& motions);
};

/// Kernels in plain integers, for any machine.
[[nodiscard]] HardKernels portable_hard_kernels();
#ifdef TANDEM_CONTACT_AVX2
/// Kernels with the same bits, eight contacts at a time; only if the processor has AVX2.
[[nodiscard]] HardKernels avx2_hard_kernels();
#endif
[[nodiscard]] HardKernels fastest_hard_kernels();

}  // namespace tandem
