#pragma once
// The shapes that a body can be drawn as.

#include <cstdint>

namespace tandem {

/// The shape of a body type. It decides the meaning of the type's shape values, which are in the body's frame
/// and in scene units.
enum class BodyShape : std::uint32_t {
  kNone = 0,
  kSphere = 1,    ///< no values: the type's radius is the sphere's
  kBox = 2,       ///< half sizes x, y, z
  kCapsule = 3,   ///< radius, half of the length between the centres of the caps, along y
  kCylinder = 4,  ///< radius, half of the height, along y
  kHull = 5,      ///< convex: points x, y, z, at least four
};

}  // namespace tandem
