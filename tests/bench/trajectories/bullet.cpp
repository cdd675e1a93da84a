// Records Bullet: rigid spheres, or cubes of the same volume, in a room of six planes.
// Usage: bullet spheres|boxes < plan > rows

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <string_view>

#include "plan.hpp"

namespace {

btVector3 vector(const recorder::Vector& v) {
  return {static_cast<btScalar>(v[0]), static_cast<btScalar>(v[1]), static_cast<btScalar>(v[2])};
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view kind = argc == 2 ? argv[1] : "";
  if (kind != "spheres" && kind != "boxes") {
    std::cerr << "usage: bullet spheres|boxes < plan > rows\n";
    return 2;
  }
  const recorder::Plan plan = recorder::read_plan();
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> owned;
  std::vector<btRigidBody*> bodies;
  const auto add = [&](btScalar mass, btCollisionShape* shape, const btVector3& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    info.m_startWorldTransform.setOrigin(at);
    info.m_friction = 0.5;
    info.m_restitution = 0.2;
    owned.push_back(std::make_unique<btRigidBody>(info));
    world.addRigidBody(owned.back().get());
    return owned.back().get();
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    recorder::Vector axes{};
    axes[axis] = 1;
    const btVector3 normal = vector(axes);
    shapes.push_back(std::make_unique<btStaticPlaneShape>(normal, static_cast<btScalar>(plan.low[axis])));
    add(0, shapes.back().get(), {0, 0, 0});
    shapes.push_back(std::make_unique<btStaticPlaneShape>(-normal, static_cast<btScalar>(-plan.high[axis])));
    add(0, shapes.back().get(), {0, 0, 0});
  }
  const auto radius = static_cast<btScalar>(plan.radius_m);
  // Half an edge of a cube with the sphere's volume: (4/3 pi)^(1/3) / 2.
  const btScalar half = 0.806F * radius;
  if (kind == "spheres") {
    shapes.push_back(std::make_unique<btSphereShape>(radius));
  } else {
    shapes.push_back(std::make_unique<btBoxShape>(btVector3(half, half, half)));
  }
  for (const recorder::Vector& at : plan.start) {
    bodies.push_back(add(1, shapes.back().get(), vector(at)));
    // A body that sleeps would not feel gravity turn.
    bodies.back()->setActivationState(DISABLE_DEACTIVATION);
  }
  return recorder::record(
      plan,
      [&](const recorder::Vector& g, double dt_s) {
        for (btRigidBody* body : bodies) body->setGravity(vector(g));
        world.stepSimulation(static_cast<btScalar>(dt_s), 0);
      },
      [&] {
        for (const btRigidBody* body : bodies)
          recorder::write_body(body->getWorldTransform().getOrigin(), body->getLinearVelocity());
      });
}
