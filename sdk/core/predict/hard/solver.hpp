#pragma once
// The passes over contacts of the predictor `hard`.

#include <array>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/contact/four.hpp"

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

/// Bodies while contacts are solved, by place. Behind the last body there is one that never moves.
struct HardMotions {
  std::span<HardRow> w;      ///< velocity
  std::span<HardRow> moved;  ///< four times the way moved in this frame
  std::span<HardRow> fall;   ///< the change of w in this frame without contacts
};

/// A contact when it is found. Its bodies are given by place; n points from b to a.
struct HardContact {
  std::uint32_t a, b;
  Vec3i n;
  std::int32_t gap;    ///< solver units times a frame
  std::int32_t share;  ///< a's part of what the contact changes
  std::uint32_t wave;
};

/// Four contacts of a wave. No body is in two of them, except bodies that they do not change.
struct alignas(16) HardGroup {
  std::array<std::uint32_t, 4> a, b;
  std::array<Four, 3> n, t1, t2;
  Four gap, share, wanted, push, slide1, slide2;
};

struct HardMaterial {
  std::int32_t slop;      ///< a gap up to this is none, solver units times a frame
  std::int32_t friction;  ///< in 2^-12
};

/// Writes a contact into its place of a group. Its impulses are 0.
void put_contact(const HardContact& contact, HardGroup& group, std::size_t at);

/// A frame of all bodies: four sub-steps, and a last pass that takes back what pushing out has left in w.
/// `groups` are in the order of their waves.
void solve_contacts(const HardMaterial& material, std::span<HardGroup> groups, const HardMotions& motions);

}  // namespace tandem
