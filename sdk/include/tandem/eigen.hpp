#pragma once
// A sample's bodies as Eigen maps, for applications that use Eigen 3.3 or later; nothing else of the SDK
// needs it.

#include <Eigen/Core>

#include "tandem/client.hpp"

namespace tandem {

/// Positions, 3 x capacity, a column a slot, scene units. Views `sample`: valid until it is filled again or
/// gone.
[[nodiscard]] inline Eigen::Map<const Eigen::Matrix3Xf> positions(const Sample& sample) {
  return {sample.positions.data(), 3, static_cast<Eigen::Index>(sample.capacity)};
}

/// 1 where a slot holds a body, 0 where not; capacity long. Views `sample`, as positions() does.
[[nodiscard]] inline Eigen::Map<const Eigen::Array<std::uint8_t, Eigen::Dynamic, 1>> alive(
    const Sample& sample) {
  return {sample.alive.data(), static_cast<Eigen::Index>(sample.capacity)};
}

}  // namespace tandem
