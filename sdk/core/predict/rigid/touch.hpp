#pragma once
// Where two solids touch, or may do so within a frame. idl/PROTOCOL.md, "Rigid".

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sdk/core/predict/rigid/solid.hpp"

namespace tandem {

struct RigidPoint {
  Vec3i n{};             ///< of length 1: from b to a
  std::int64_t gap = 0;  ///< 1/64 lattice unit; below 0: an overlap
  Vec3l at{};            ///< from a's centre, 1/64 lattice unit
};

/// The points of one pair, in their order.
class RigidPoints {
 public:
  static constexpr std::size_t kMaxPoints = 8;

  void add(const RigidPoint& point) {
    if (count_ < kMaxPoints) points_[count_++] = point;
  }
  void clear() { count_ = 0; }
  [[nodiscard]] std::span<RigidPoint> all() { return std::span(points_).first(count_); }

 private:
  std::array<RigidPoint, kMaxPoints> points_{};
  std::size_t count_ = 0;
};

/// Adds the points where a and b, not both boxes, are nearer than `margin` (1/64 lattice unit, at most 2^29).
/// `d` is b's centre minus a's, in the same unit, within +-2^31 on each axis.
void touch_solids(const PlacedSolid& a, const PlacedSolid& b, const Vec3l& d, std::int64_t margin,
                  RigidPoints& points);

}  // namespace tandem
