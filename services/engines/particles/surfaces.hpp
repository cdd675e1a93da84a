#pragma once
// Forces of boxes and balls of the scene on a body. Planes, which nearly every body is near to, are a
// kernel's.

#include <span>
#include <vector>

#include "services/engines/common/world.hpp"
#include "services/engines/particles/kernels.hpp"

namespace tandem::engine {

/// The boxes and balls of a world.
class Surfaces {
 public:
  explicit Surfaces(const EngineWorld& world);
  [[nodiscard]] bool empty() const { return boxes_.empty() && balls_.empty(); }
  /// Adds the forces on the bodies of a group, first of all boxes, then of all balls.
  void add(const Record* records, std::uint32_t first, Sums& sums) const;

 private:
  struct Extent {
    Vec3f low{}, high{};
  };
  [[nodiscard]] static bool near(const Extent& a, const Extent& b);

  std::vector<Box> boxes_;
  std::vector<Ball> balls_;
  std::vector<Extent> box_extents_, ball_extents_;
  Material wall_;
};

}  // namespace tandem::engine
