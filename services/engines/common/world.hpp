#pragma once
// The description of a particle simulation, as plain values. Scenes fill it in.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tandem::engine {

using Vec3f = std::array<float, 3>;

/// Penalty contact (S. Green, "Particle Simulation using CUDA", 2008): for the overlap o of two spheres along
/// the unit vector n from this one to the other, relative velocity u (other - this) and its tangential part
/// u_t,
///   force = -spring * o * n + damping * u + shear * u_t.
/// For a step of h seconds and bodies with z neighbours, a pile settles if about z * (damping + shear) * h /
/// mass < 1 and spring * h^2 / mass < 0.25. Otherwise a deep pile boils for ever.
struct Material {
  float spring = 200;    ///< mass units / s^2, >= 0
  float damping = 1.5F;  ///< mass units / s, >= 0
  float shear = 1.5F;    ///< mass units / s, >= 0
};

struct ParticleType {
  float radius = 0.5F;  ///< scene units, > 0
  float mass = 1;       ///< > 0
};

/// Bodies stay on the side that the normal points to: dot(normal, p) >= offset.
struct Plane {
  Vec3f normal{0, 1, 0};  ///< unit length
  float offset = 0;
};

/// A solid box.
struct Box {
  Vec3f centre{};
  Vec3f half{1, 1, 1};  ///< > 0
  std::array<Vec3f, 3> axes{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< orthonormal: the box's x, y, z in the scene
};

/// A solid sphere.
struct Ball {
  Vec3f centre{};
  float radius = 1;
};

/// A body at the start, in the slot of its index.
struct StartBody {
  Vec3f position{};
  Vec3f velocity{};
  std::uint16_t type = 0;
};

/// Puts new bodies into free slots, lowest slot first, at random points of an axis-parallel box. Without a
/// free slot, the body is left out.
struct Emitter {
  Vec3f low{}, high{};
  Vec3f velocity{};
  double rate_per_s = 0;
  std::uint16_t type = 0;
};

/// Does something to every body whose centre is in an axis-parallel box after integration.
struct Region {
  enum class Action : std::uint8_t { kRemove, kTeleport, kSetType };
  Vec3f low{}, high{};
  Action action = Action::kRemove;
  Vec3f offset{};          ///< kTeleport: added to the position
  std::uint16_t type = 0;  ///< kSetType
};

struct EngineWorld {
  std::uint32_t capacity = 0;  ///< slots, 1 .. 2^22
  std::uint64_t seed = 0;      ///< for emitters
  float dt_s = 1.0F / 30.0F;
  /// Contact sub-steps per step. Gravity and damping act once per step, so that a body in free flight moves
  /// as the predicted step says.
  std::uint32_t substeps = 1;
  Vec3f gravity{0, -9.81F, 0};
  float damping_per_s = 0;  ///< share of the velocity lost, >= 0, times dt_s < 1
  /// Bodies below this speed (scene units / s) that touch something for a second, with all around them, fall
  /// asleep: they stand still until something wakes them. 0: never.
  float sleep_speed = 0;
  Vec3f low{-100, -100, -100}, high{100, 100, 100};  ///< a body whose centre leaves these bounds is removed
  Material pair, wall;
  std::vector<ParticleType> types;
  std::vector<Plane> planes;
  std::vector<Box> boxes;
  std::vector<Ball> balls;
  std::vector<StartBody> start;
  std::vector<Emitter> emitters;
  std::vector<Region> regions;
  double max_gravity = 1000;  ///< inputs beyond are refused; scene units / s^2
  double max_push = 1000;     ///< inputs beyond are refused; scene units / s
  /// Maximum by which the pushes of one participant may change the mean velocity of all bodies in a second,
  /// scene units / s. A participant can save up one push of max_push at all bodies. 0: no limit.
  double push_budget = 0;
};

/// Hash of everything in `world` that a trajectory depends on.
[[nodiscard]] std::uint64_t fingerprint(const EngineWorld& world);

}  // namespace tandem::engine
