#pragma once
// What a body looks like.

#include <cstdint>

namespace tandem {

/// Says what a type's shape values are: in the body's frame, scene units.
enum class BodyShape : std::uint32_t {
  kNone = 0,
  kSphere = 1,    ///< no values: the radius
  kBox = 2,       ///< half sizes x, y, z
  kCapsule = 3,   ///< radius, half of the length between the centres of the caps, along y
  kCylinder = 4,  ///< radius, half of the height, along y
  kHull = 5,      ///< convex: points x, y, z, at least four
};

}  // namespace tandem
