#pragma once
// A sample's bodies as Eigen maps, for applications that use Eigen 3.3 or later; nothing else of the SDK
// needs it.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tandem/client.hpp"

namespace tandem {

/// Positions, 3 x capacity, a column a slot, scene units. Views `sample`: valid until it is filled again or
/// gone.
[[nodiscard]] inline Eigen::Map<const Eigen::Matrix3Xf> positions(const Sample& sample) {
  return {sample.positions.data(), 3, static_cast<Eigen::Index>(sample.capacity)};
}

/// Whether the session has orientations, which the next two need.
[[nodiscard]] inline bool has_orientations(const Sample& sample) { return !sample.orientations.empty(); }

/// Orientations, 4 x capacity, a column a slot: the coefficients x, y, z, w of an Eigen::Quaternionf. 4 x 0
/// without orientations. Views `sample`, as positions() does.
[[nodiscard]] inline Eigen::Map<const Eigen::Matrix4Xf> orientations(const Sample& sample) {
  return {sample.orientations.data(), 4, static_cast<Eigen::Index>(sample.orientations.size() / 4)};
}

/// Of the body in `slot`, below capacity and alive: from its frame to the world's, of norm 1. Needs
/// orientations. Views `sample`, as positions() does.
[[nodiscard]] inline Eigen::Map<const Eigen::Quaternionf> orientation(const Sample& sample,
                                                                      std::uint32_t slot) {
  return Eigen::Map<const Eigen::Quaternionf>(sample.orientations.data() + std::size_t{4} * slot);
}

/// 1 where a slot holds a body, 0 where not; capacity long. Views `sample`, as positions() does.
[[nodiscard]] inline Eigen::Map<const Eigen::Array<std::uint8_t, Eigen::Dynamic, 1>> alive(
    const Sample& sample) {
  return {sample.alive.data(), static_cast<Eigen::Index>(sample.capacity)};
}

}  // namespace tandem
