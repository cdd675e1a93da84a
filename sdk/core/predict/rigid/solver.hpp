#pragma once
// The sub-steps of the predictor `rigid`: impulses along the contacts of a frame.

#include <array>
#include <cstdint>
#include <span>

#include "sdk/core/predict/rigid/solid.hpp"
#include "sdk/core/predict/rigid/touch.hpp"

namespace tandem {

/// A body while contacts are solved; all in the solver's unit, a spin times the radius of the sphere around
/// the body.
struct RigidMotion {
  Vec3i v{}, spin{};
  Vec3l moved{}, turned{};  ///< sums of v and of spin over the sub-steps
  Vec3i fall{};             ///< the change of v in this frame without contacts
};

/// What contacts need of a body.
struct RigidBody {
  Inertia inertia{};            ///< inverse, in 2^-12
  std::int64_t per_length = 0;  ///< 2^40 over the radius of the sphere around it
  std::int64_t most_arm = 0;    ///< 1/64 lattice unit
  std::int32_t mobility = 0;
};

/// The effect of an impulse in one direction: that of a part of the relative velocity.
struct RigidRow {
  Vec3i d{};                 ///< in 2^-14
  Vec3i arm_a{}, arm_b{};    ///< arm x d, in 2^-14
  Vec3i turn_a{}, turn_b{};  ///< the change of both spins, in 2^-14
  std::int32_t inverse = 0;  ///< 1 / (the change of the relative velocity), in 2^-16
};

struct RigidContact {
  static constexpr std::size_t kRows = 3;  ///< the normal, and two tangents

  std::uint32_t a = 0, b = 0;             ///< places; the number of bodies is the geometry
  std::int32_t share_a = 0, share_b = 0;  ///< the change of both velocities, in 2^-14
  std::int32_t gap = 0, wanted = 0;
  std::array<std::int32_t, kRows> push{};
  std::array<RigidRow, kRows> rows{};
};

/// What holds for all contacts of a frame.
struct RigidMaterial {
  std::uint32_t substep_bits = 0;
  std::int32_t slop = 0;      ///< a gap up to this is none, solver's unit
  std::int32_t friction = 0;  ///< in 2^-12
};

/// Fills all but a, b and gap. `at`: from both centres, 1/64 lattice unit; `b` is null for the geometry.
void set_rows(const RigidBody& a, const RigidBody* b, const Vec3l& at_a, const Vec3l& at_b, const Vec3i& n,
              RigidContact& contact);

/// The direction and the arms of the first row of set_rows().
[[nodiscard]] RigidRow normal_row(const RigidBody& a, const RigidBody* b, const Vec3l& at_a,
                                  const Vec3l& at_b, const Vec3i& n);

/// The relative velocity of both bodies along a row, a's minus b's.
[[nodiscard]] std::int64_t speed_along(const RigidRow& row, const RigidMotion& a, const RigidMotion& b);

/// A frame of all bodies. Behind the last of them `motions` has one for the geometry.
void solve(const RigidMaterial& material, std::span<RigidContact> contacts, std::span<RigidMotion> motions);

}  // namespace tandem
