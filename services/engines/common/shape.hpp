#pragma once
// The shape of a rigid body.

#include <cstdint>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::engine {

/// A shape in the body's frame, around its centre of mass; scene units. Kinds and values are those of a
/// session's body types: idl/PROTOCOL.md, "Fields".
struct Shape {
  enum class Kind : std::uint8_t { kSphere = 1, kBox = 2, kCapsule = 3, kCylinder = 4, kHull = 5 };
  Kind kind = Kind::kSphere;
  float radius = 0;  ///< a sphere's; unused by others
  /// Box: half sizes x, y, z. Capsule: radius, half of the length between the centres of its caps, along y.
  /// Cylinder: radius, half of the height along y. Hull: points x, y, z.
  std::vector<float> values;

  friend bool operator==(const Shape&, const Shape&) = default;
};

inline constexpr std::size_t kMaxHullPoints = 256;

/// The kind with the name sphere, box, capsule, cylinder or hull. Errors: kInvalidArgument for another name.
[[nodiscard]] Result<Shape::Kind> shape_kind(std::string_view name);

/// Errors: kInvalidArgument with the rule that `shape` breaks. A hull must have an extent along each axis.
[[nodiscard]] Result<void> check(const Shape& shape);

/// The distance from the centre to the farthest point, for a shape that check() accepts.
[[nodiscard]] double bounding_radius(const Shape& shape);
/// Half of the minimum extent along x, y and z: the size that errors are compared with.
[[nodiscard]] double inner_radius(const Shape& shape);

}  // namespace tandem::engine
