#pragma once
// Bodies with their shapes where they are in a frame. idl/PROTOCOL.md, "Rigid", has the formulas.

#include <array>
#include <cstdint>

#include "sdk/core/predict/rigid/constants.hpp"

namespace tandem {

using Vec3l = std::array<std::int64_t, 3>;

/// Numbers of idl/PROTOCOL.md, "Rigid". Lengths of contacts are in 1/64 lattice unit.
struct RigidLaw {
  static constexpr unsigned kAxisBits = 24;             ///< of a component 1 of a body's axes
  static constexpr unsigned kNormalBits = 14;           ///< of a component 1 of a normal
  static constexpr unsigned kInertiaBits = 12;          ///< of an inverse inertia of 1
  static constexpr unsigned kLengthBits = 6;            ///< of a lattice unit
  static constexpr std::int64_t kMaxMargin = 1 << 23;   ///< lattice units
  static constexpr std::int64_t kMaxInertia = 1 << 18;  ///< inverse, in 2^-12
};

/// A type in this frame: with its learned sizes.
struct SizedSolid {
  Solid::Kind kind = Solid::Kind::kRound;
  Vec3l size{};                           ///< 1/64 lattice unit
  std::int64_t radius = 1;                ///< of the sphere around it, lattice units: 1 .. 2^23
  std::int64_t rounding = 0;              ///< radius of a box's edges, 1/64 lattice unit
  std::array<std::int64_t, 3> inverse{};  ///< inertia: radius^2 / (inertia of mass 1), in 2^-12
};
/// `longer`: what sizes are longer; `rounding`: the radius of edges by the smallest half size; in 1/65536.
[[nodiscard]] SizedSolid sized(const Solid& solid, std::int32_t longer, std::int32_t rounding);

/// A solid where it is.
struct PlacedSolid {
  const SizedSolid* solid = nullptr;
  std::array<Vec3i, 3> axes{};  ///< its x, y and z in the world
  Vec3i p{};                    ///< lattice units
};
/// The axes of a body that is turned by q.
[[nodiscard]] std::array<Vec3i, 3> axes_of(const Quaternion& q);

/// A symmetric matrix: xx, yy, zz, xy, yz, zx.
using Inertia = std::array<std::int64_t, 6>;
/// The inverse inertia in the world, in 2^-12.
[[nodiscard]] Inertia inertia_of(const PlacedSolid& placed);

[[nodiscard]] inline std::int64_t product(const auto& a, const auto& b) {
  return std::int64_t{a[0]} * b[0] + std::int64_t{a[1]} * b[1] + std::int64_t{a[2]} * b[2];
}
/// A point along an axis of a solid.
[[nodiscard]] inline std::int64_t along(const Vec3i& axis, const Vec3l& x) {
  return product(axis, x) >> RigidLaw::kAxisBits;
}
/// The sum of the solid's axes, each times a component of x: what x in its frame is in the world.
[[nodiscard]] inline Vec3l in_world(const std::array<Vec3i, 3>& axes, const Vec3l& x) {
  Vec3l sum{};
  for (std::size_t i = 0; i < 3; ++i)
    sum[i] = (axes[0][i] * x[0] + axes[1][i] * x[1] + axes[2][i] * x[2]) >> RigidLaw::kAxisBits;
  return sum;
}

}  // namespace tandem
