#pragma once
// Contacts of bodies with the static geometry, for the predictors `contact` and `field`.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

/// The depth of a touch (lattice units, <= 0: no touch), and the unit vector (in 2^-14) out of the surface.
struct WallTouch {
  std::int64_t overlap = 0;
  Vec3i out{};
};

/// How far a point is above a plane, lattice units.
[[nodiscard]] inline std::int64_t height_above(const ContactConstants::Plane& plane, const Vec3i& p) {
  const auto& [x, y, z] = plane.normal;
  return ((std::int64_t{x} * p[0] + std::int64_t{y} * p[1] + std::int64_t{z} * p[2]) >> 30) - plane.offset;
}
[[nodiscard]] WallTouch touch(const ContactConstants::Plane& plane, const Vec3i& p, std::int32_t radius);
[[nodiscard]] WallTouch touch(const ContactConstants::Box& box, const Vec3i& p, std::int32_t radius);
[[nodiscard]] WallTouch touch(const ContactConstants::Ball& ball, const Vec3i& p, std::int32_t radius);

/// The static geometry, and its forces on bodies that touch it.
class ContactWalls {
 public:
  /// `largest_radius`: of all types. `constants` must outlive this.
  ContactWalls(const ContactConstants& constants, const ContactLaw& law, std::int32_t largest_radius);

  /// Adds forces. `forces` is indexed by place, as `bodies`.
  void add_forces(std::span<const ContactBody> bodies, std::span<ContactForce> forces) const;

  /// The region low <= normal . p <= high, with p in lattice units; not wider than 2^63.
  struct Slab {
    Vec3i normal{};
    std::int64_t low = 0, high = 0;
  };

 private:
  template <class Shape>
  void add_shapes(std::span<const Shape> shapes, std::span<const Slab> slabs, const struct PlacesOf64& places,
                  std::span<const ContactBody> bodies, std::span<ContactForce> forces) const;

  const ContactConstants& constants_;
  ContactLaw law_;
  std::vector<Slab> planes_, boxes_, balls_;  // one per plane, three per other shape
};

}  // namespace tandem
