#pragma once
// Bullet's objects of one world. Internal to bullet: the only header here that includes Bullet's.

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "services/engines/bullet/motion.hpp"
#include "services/engines/bullet/world.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Owns everything that Bullet works on. Bodies are known by their slot. Not copied: Bullet holds addresses.
class Physics {
 public:
  /// `world` must outlive this object. Precondition: it was checked.
  explicit Physics(const RigidWorld& world);
  Physics(const Physics&) = delete;
  Physics& operator=(const Physics&) = delete;
  Physics(Physics&&) = delete;
  Physics& operator=(Physics&&) = delete;
  ~Physics() = default;

  /// Into a free slot. `activity`: Bullet's activation state, `still_s`: how long it has been
  /// slow.
  void add(std::uint32_t slot, std::uint16_t type, const Motion& motion, int activity = ACTIVE_TAG,
           float still_s = 0);
  /// Removes a body, and wakes those that may have rested on it.
  void remove(std::uint32_t slot);
  /// Wakes all bodies.
  void set_gravity(const Vec3& gravity);
  /// An impulse that changes the velocity by `change`, at the point of the body nearest to `centre`.
  void push(std::uint32_t slot, const Vec3f& centre, const Vec3f& change);
  void set_angular_velocity(std::uint32_t slot, const Vec3f& angular_velocity);
  void step(float dt_s);

  [[nodiscard]] Motion motion(std::uint32_t slot) const;
  [[nodiscard]] int activity(std::uint32_t slot) const { return bodies_[slot]->getActivationState(); }
  [[nodiscard]] float still_s(std::uint32_t slot) const { return bodies_[slot]->getDeactivationTime(); }
  /// Sets a 1 for every body with a contact.
  void mark_touching(std::span<std::uint8_t> touching) const;

 private:
  void cruise(const Cruise& cruise, float dt_s);
  void add_scene();
  void add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& at);

  const RigidWorld* world_;
  // Members that are declared first are destroyed last: bodies outlive the world that lists them.
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;  // by type
  std::vector<btVector3> inertia_;                         // by type
  std::vector<std::unique_ptr<btCollisionShape>> scene_shapes_;
  std::vector<std::unique_ptr<btRigidBody>> scene_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;  // by slot; none: free
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld dynamics_;
};

}  // namespace tandem::engine
