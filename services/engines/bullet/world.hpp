#pragma once
// The description of a simulation of rigid bodies, as plain values. Scenes fill it in.

#include <array>
#include <optional>
#include <vector>

#include "services/engines/common/shape.hpp"
#include "services/engines/common/world.hpp"

namespace tandem::engine {

/// x, y, z, w; from body to world.
using Quaternion = std::array<float, 4>;

/// Bodies with a speed of their own, in a ball around the origin.
struct Cruise {
  float radius = 1;               ///< of the ball, > 0
  float acceleration = 0;         ///< in the ball, along the body's way, until it has its speed; >= 0
  float return_acceleration = 0;  ///< outside of it, towards the origin; >= 0
  std::vector<float> speed;       ///< by slot, >= 0
};

struct RigidWorld {
  /// Must have no emitters and no regions; materials are not used. Of a type only the mass is used; its
  /// radius is for the predictors.
  EngineWorld world;
  std::vector<Shape> shapes;            ///< by type
  std::vector<Quaternion> orientation;  ///< of the bodies at the start, norm 1; empty: none is turned
  float friction = 0.5F;                ///< of all bodies and of the scene, 0 .. 10
  float restitution = 0;                ///< 0 .. 1
  std::vector<Vec3f> spin;              ///< of the bodies at the start, rad / s; empty: none spins
  std::optional<Cruise> cruise;
};

}  // namespace tandem::engine
