#pragma once
// What stands still in a world, and the law of contact forces. Predictors of contacts compute with both.

#include <array>
#include <cstdint>
#include <vector>

#include "tandem/simulation.hpp"

namespace tandem {

/// The solid things that bodies meet, and the law by which contacts push them. Clients predict contacts with
/// it. A prediction that is nearer to the simulation needs fewer bits; an error never makes a client wrong.
/// Units: scene units, the mass units of ServedType::mass, seconds.
struct Scenery {
  /// Penalty contact (S. Green, "Particle Simulation using CUDA", 2008): for two spheres with overlap o along
  /// the unit vector n from this one to the other, relative velocity u (other - this) and its tangential part
  /// u_t, force = -spring * o * n + damping * u + shear * u_t.
  struct Law {
    double spring = 200;   ///< mass units / s^2, >= 0; 0: bodies pass through each other
    double damping = 1.5;  ///< mass units / s, >= 0
    double shear = 1.5;    ///< mass units / s, >= 0
  };
  /// Bodies stay on the side that the normal points to: dot(normal, p) >= offset.
  struct Plane {
    engine::Vec3 normal{0, 1, 0};  ///< unit length
    double offset = 0;
  };
  struct Box {
    engine::Vec3 centre{}, half{1, 1, 1};  ///< half: > 0
    /// The directions of the box's x, y and z in the scene; orthonormal.
    std::array<engine::Vec3, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  };
  struct Ball {
    engine::Vec3 centre{};
    double radius = 1;
  };

  Law between_bodies = {}, with_scenery = {};
  std::uint32_t substeps = 1;  ///< contact substeps of one step, 1..16
  std::vector<Plane> planes = {};
  std::vector<Box> boxes = {};
  std::vector<Ball> balls = {};
};

}  // namespace tandem
