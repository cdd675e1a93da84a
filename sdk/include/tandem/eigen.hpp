#pragma once
// A sample's bodies as Eigen maps, for applications that use Eigen 3.3 or later. Nothing else in the SDK
// needs Eigen.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tandem/client.hpp"

namespace tandem {

/// Positions, 3 x capacity, one column for each slot, scene units. The map views `sample`: it is valid until
/// the sample is filled again or destroyed.
[[nodiscard]] inline Eigen::Map<const Eigen::Matrix3Xf> positions(const Sample& sample) {
  return {sample.positions.data(), 3, static_cast<Eigen::Index>(sample.capacity)};
}

/// Whether the session has orientations. The next two functions need them.
[[nodiscard]] inline bool has_orientations(const Sample& sample) { return !sample.orientations.empty(); }

/// Orientations, 4 x capacity, one column for each slot: the coefficients x, y, z, w of an
/// Eigen::Quaternionf. The size is 4 x 0 without orientations. The map views `sample`, as positions() does.
[[nodiscard]] inline Eigen::Map<const Eigen::Matrix4Xf> orientations(const Sample& sample) {
  return {sample.orientations.data(), 4, static_cast<Eigen::Index>(sample.orientations.size() / 4)};
}

/// The orientation of the body in `slot`, which is below capacity and alive: from the body's frame to the
/// world's, of norm 1. Needs orientations. The map views `sample`, as positions() does.
[[nodiscard]] inline Eigen::Map<const Eigen::Quaternionf> orientation(const Sample& sample,
                                                                      std::uint32_t slot) {
  return Eigen::Map<const Eigen::Quaternionf>(sample.orientations.data() + std::size_t{4} * slot);
}

/// 1 if a slot holds a body, 0 if not; `capacity` long. The map views `sample`, as positions() does.
[[nodiscard]] inline Eigen::Map<const Eigen::Array<std::uint8_t, Eigen::Dynamic, 1>> alive(
    const Sample& sample) {
  return {sample.alive.data(), static_cast<Eigen::Index>(sample.capacity)};
}

}  // namespace tandem
