// Records rigid bodies of Bullet with their orientation. Usage: rigid_bullet < plan > rows

#include <btBulletDynamicsCommon.h>

#include <memory>

#include "rigid_plan.hpp"

namespace {

btScalar scalar(double v) { return static_cast<btScalar>(v); }
btVector3 vector(const recorder::Vector& v) { return {scalar(v[0]), scalar(v[1]), scalar(v[2])}; }

std::unique_ptr<btCollisionShape> make_shape(const recorder::Shape& shape) {
  const auto& v = shape.values;
  if (shape.kind == 1) return std::make_unique<btSphereShape>(scalar(v[0]));
  if (shape.kind == 2)
    return std::make_unique<btBoxShape>(btVector3(scalar(v[0]), scalar(v[1]), scalar(v[2])));
  return std::make_unique<btCapsuleShape>(scalar(v[0]), scalar(2 * v[1]));
}

}  // namespace

int main() {
  const recorder::RigidPlan plan = recorder::read_plan();
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> scene, bodies;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  const auto add = [&](double mass, btCollisionShape* shape, const btTransform& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(scalar(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(scalar(mass), nullptr, shape, inertia);
    info.m_startWorldTransform = at;
    info.m_friction = 0.6F;
    info.m_restitution = 0.05F;
    auto body = std::make_unique<btRigidBody>(info);
    world.addRigidBody(body.get());
    return body;
  };
  for (const recorder::Shape& shape : plan.shapes) shapes.push_back(make_shape(shape));
  for (const recorder::Plane& plane : plan.planes) {
    shapes.push_back(std::make_unique<btStaticPlaneShape>(vector(plane.normal), scalar(plane.offset)));
    scene.push_back(add(0, shapes.back().get(), btTransform::getIdentity()));
  }
  for (const recorder::Body& body : plan.bodies) {
    const auto& q = body.turn;
    const btQuaternion turn(scalar(q[1]), scalar(q[2]), scalar(q[3]), scalar(q[0]));
    bodies.push_back(add(body.mass, shapes[body.shape].get(), btTransform(turn, vector(body.at))));
    if (!plan.sleep) bodies.back()->setActivationState(DISABLE_DEACTIVATION);
  }
  return recorder::record(
      plan,
      [&](const recorder::Vector& g) {
        for (auto& body : bodies) body->activate(true);
        world.setGravity(vector(g));
      },
      [&](const recorder::Kick& kick) {
        for (auto& body : bodies) {
          if ((body->getWorldTransform().getOrigin() - vector(kick.centre)).length() > scalar(kick.radius))
            continue;
          body->activate(true);
          body->setLinearVelocity(body->getLinearVelocity() + vector(kick.change));
        }
      },
      [&](double dt_s) {
        world.stepSimulation(scalar(dt_s), 0);
        for (auto& body : bodies) {
          const btScalar speed = body->getAngularVelocity().length();
          if (speed > scalar(recorder::kMaxTurnPerS))
            body->setAngularVelocity(body->getAngularVelocity() * (scalar(recorder::kMaxTurnPerS) / speed));
        }
      },
      [&] {
        for (const auto& body : bodies) {
          const btTransform& at = body->getWorldTransform();
          const btQuaternion q = at.getRotation();
          const btVector3& p = at.getOrigin();
          const bool asleep = body->getActivationState() == ISLAND_SLEEPING;
          const btVector3 v = asleep ? btVector3(0, 0, 0) : body->getLinearVelocity();
          const btVector3 w = asleep ? btVector3(0, 0, 0) : body->getAngularVelocity();
          recorder::write_body(
              {p.x(), p.y(), p.z(), v.x(), v.y(), v.z(), q.w(), q.x(), q.y(), q.z(), w.x(), w.y(), w.z()});
        }
      });
}
