#pragma once
// Where a body touches the static geometry of the tier `contact`.

#include <cstdint>

#include "sdk/core/predict/contact_constants.hpp"

namespace tandem {

/// How deep (lattice units, <= 0: not at all), and the unit vector (in 2^-14) out of the surface.
struct WallTouch {
  std::int64_t overlap = 0;
  Vec3i out{};
};

[[nodiscard]] WallTouch touch(const ContactConstants::Plane& plane, const Vec3i& p, std::int32_t radius);
[[nodiscard]] WallTouch touch(const ContactConstants::Box& box, const Vec3i& p, std::int32_t radius);
[[nodiscard]] WallTouch touch(const ContactConstants::Ball& ball, const Vec3i& p, std::int32_t radius);

/// Largest r with r * r <= x.
[[nodiscard]] std::int64_t root(std::uint64_t x);

}  // namespace tandem
