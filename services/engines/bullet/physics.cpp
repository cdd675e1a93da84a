#include "services/engines/bullet/physics.hpp"

#include <cmath>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::engine {
namespace {

// An island whose bodies move less than this for two seconds falls asleep; piles tremble with less. Bullet's
// defaults, 0.8 and 1, stop bodies that are just tipping over.
constexpr btScalar kSleepMPerS = 0.25F;
constexpr btScalar kSleepRadPerS = 0.5F;
// In scene units. Without it, a ball on a plane rolls for ever. Only round bodies have it, as it takes three
// more constraints a contact, and most of the time of a heap of boxes.
constexpr btScalar kRollingFriction = 0.005F;
// Relative to the hull's size; Bullet's default, 4 cm, is as large as a small hull. Hulls grow by it.
constexpr btScalar kHullMargin = 0.02F;
constexpr int kSceneSlot = -1;

btVector3 vector(const Vec3f& v) { return {v[0], v[1], v[2]}; }
Vec3f floats(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

bool is_round(Shape::Kind kind) {
  return kind == Shape::Kind::kSphere || kind == Shape::Kind::kCapsule || kind == Shape::Kind::kCylinder;
}

std::unique_ptr<btCollisionShape> make_shape(const Shape& shape) {
  const std::vector<float>& v = shape.values;
  switch (shape.kind) {
    case Shape::Kind::kBox:
      return std::make_unique<btBoxShape>(btVector3(v[0], v[1], v[2]));
    case Shape::Kind::kCapsule:
      return std::make_unique<btCapsuleShape>(v[0], 2 * v[1]);
    case Shape::Kind::kCylinder:
      return std::make_unique<btCylinderShape>(btVector3(v[0], v[1], v[0]));
    case Shape::Kind::kHull: {
      auto hull = std::make_unique<btConvexHullShape>();
      for (std::size_t i = 0; i < v.size(); i += 3) hull->addPoint({v[i], v[i + 1], v[i + 2]}, false);
      hull->setMargin(kHullMargin * static_cast<btScalar>(inner_radius(shape)));
      hull->recalcLocalAabb();
      return hull;
    }
    case Shape::Kind::kSphere:
      break;
  }
  return std::make_unique<btSphereShape>(shape.radius);
}

// The point of a body nearest to `point`, both in the body's frame. It is exact for a sphere; for other
// shapes it is a point of the box around them, which is close enough for a push.
btVector3 nearest(const Shape& shape, const btCollisionShape& built, const btVector3& point) {
  if (shape.kind == Shape::Kind::kSphere) {
    const btScalar distance = point.length();
    return distance > shape.radius ? point * (shape.radius / distance) : point;
  }
  btVector3 low;
  btVector3 high;
  built.getAabb(btTransform::getIdentity(), low, high);
  btVector3 result = point;
  result.setMax(low);
  result.setMin(high);
  return result;
}

}  // namespace

Physics::Physics(const RigidWorld& world)
    : world_(&world),
      bodies_(world.world.capacity),
      dispatcher_(&configuration_),
      dynamics_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  solver_.setRandSeed(static_cast<unsigned long>(world.world.seed & 0xffffffffU));
  dynamics_.setForceUpdateAllAabbs(false);  // sleeping bodies stay where they are
  for (std::size_t type = 0; type < world.shapes.size(); ++type) {
    shapes_.push_back(make_shape(world.shapes[type]));
    btVector3 inertia;
    shapes_.back()->calculateLocalInertia(world.world.types[type].mass, inertia);
    inertia_.push_back(inertia);
  }
  add_scene();
  const Vec3f& g = world.world.gravity;
  dynamics_.setGravity(vector(g));
}

void Physics::add_scene() {
  const EngineWorld& world = world_->world;
  for (const Plane& plane : world.planes) {
    add_static(std::make_unique<btStaticPlaneShape>(vector(plane.normal), plane.offset),
               btTransform::getIdentity());
  }
  for (const Box& box : world.boxes) {
    const auto& a = box.axes;
    const btMatrix3x3 basis(a[0][0], a[1][0], a[2][0], a[0][1], a[1][1], a[2][1], a[0][2], a[1][2], a[2][2]);
    add_static(std::make_unique<btBoxShape>(vector(box.half)), btTransform(basis, vector(box.centre)));
  }
  for (const Ball& ball : world.balls) {
    add_static(std::make_unique<btSphereShape>(ball.radius),
               btTransform(btQuaternion::getIdentity(), vector(ball.centre)));
  }
}

void Physics::add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& at) {
  btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape.get());
  info.m_startWorldTransform = at;
  info.m_friction = world_->friction;
  info.m_restitution = world_->restitution;
  scene_.push_back(std::make_unique<btRigidBody>(info));
  scene_.back()->setUserIndex(kSceneSlot);
  dynamics_.addRigidBody(scene_.back().get());
  scene_shapes_.push_back(std::move(shape));
}

void Physics::add(std::uint32_t slot, std::uint16_t type, const Motion& motion, int activity, float still_s) {
  TANDEM_ASSERT(slot < bodies_.size() && bodies_[slot] == nullptr && type < shapes_.size());
  btRigidBody::btRigidBodyConstructionInfo info(world_->world.types[type].mass, nullptr, shapes_[type].get(),
                                                inertia_[type]);
  const Quaternion& q = motion.orientation;
  info.m_startWorldTransform = btTransform(btQuaternion(q[0], q[1], q[2], q[3]), vector(motion.position));
  info.m_friction = world_->friction;
  info.m_restitution = world_->restitution;
  if (is_round(world_->shapes[type].kind))
    info.m_rollingFriction = info.m_spinningFriction = kRollingFriction;
  info.m_linearSleepingThreshold = kSleepMPerS;
  info.m_angularSleepingThreshold = kSleepRadPerS;
  auto body = std::make_unique<btRigidBody>(info);
  // The predicted step takes a share of the velocity once a frame. Bullet raises the rest to the power of
  // seconds.
  const auto kept =
      1.0 - static_cast<double>(world_->world.damping_per_s) * static_cast<double>(world_->world.dt_s);
  const auto damping = static_cast<btScalar>(1 - std::pow(kept, 1 / static_cast<double>(world_->world.dt_s)));
  body->setDamping(damping, damping);
  body->setLinearVelocity(vector(motion.velocity));
  body->setAngularVelocity(vector(motion.angular_velocity));
  body->setUserIndex(static_cast<int>(slot));
  body->setUserIndex2(type);
  dynamics_.addRigidBody(body.get());
  body->forceActivationState(activity);
  body->setDeactivationTime(still_s);
  bodies_[slot] = std::move(body);
}

void Physics::remove(std::uint32_t slot) {
  btRigidBody* body = bodies_[slot].get();
  TANDEM_ASSERT(body != nullptr);
  // Bullet does not wake bodies that have lost their support. Sleeping bodies have pairs, but not always
  // contacts.
  const btBroadphasePairArray& pairs = broadphase_.getOverlappingPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    auto* a = static_cast<btCollisionObject*>(pairs[i].m_pProxy0->m_clientObject);
    auto* b = static_cast<btCollisionObject*>(pairs[i].m_pProxy1->m_clientObject);
    if (a == body || b == body) (a == body ? b : a)->activate();
  }
  dynamics_.removeRigidBody(body);
  bodies_[slot].reset();
}

void Physics::set_gravity(const Vec3& gravity) {
  for (const auto& body : bodies_) {
    if (body) body->activate(true);
  }
  // Reaches active bodies only.
  dynamics_.setGravity({static_cast<btScalar>(gravity[0]), static_cast<btScalar>(gravity[1]),
                        static_cast<btScalar>(gravity[2])});
}

void Physics::push(std::uint32_t slot, const Vec3f& centre, const Vec3f& change) {
  btRigidBody& body = *bodies_[slot];
  const auto type = static_cast<std::size_t>(body.getUserIndex2());
  const btTransform& at = body.getWorldTransform();
  const btVector3 point = nearest(world_->shapes[type], *shapes_[type], at.inverse() * vector(centre));
  body.activate(true);
  body.applyImpulse(vector(change) * world_->world.types[type].mass, at.getBasis() * point);
}

void Physics::set_angular_velocity(std::uint32_t slot, const Vec3f& angular_velocity) {
  bodies_[slot]->setAngularVelocity(vector(angular_velocity));
}

// Does not use Bullet's sub-steps, which would keep a remainder of time.
void Physics::step(float dt_s) {
  if (world_->cruise) cruise(*world_->cruise, dt_s);
  dynamics_.stepSimulation(dt_s, 0);
}

void Physics::cruise(const Cruise& cruise, float dt_s) {
  for (std::uint32_t slot = 0; slot < bodies_.size(); ++slot) {
    if (!bodies_[slot]) continue;
    const Vec3f now = floats(bodies_[slot]->getLinearVelocity());
    const Vec3f next = cruised(floats(bodies_[slot]->getWorldTransform().getOrigin()), now,
                               cruise.speed[slot], cruise, dt_s);
    if (next == now) continue;
    bodies_[slot]->activate();
    bodies_[slot]->setLinearVelocity(vector(next));
  }
}

Motion Physics::motion(std::uint32_t slot) const {
  const btRigidBody& body = *bodies_[slot];
  const btTransform& at = body.getWorldTransform();
  const btQuaternion q = at.getRotation();
  Motion motion{.position = floats(at.getOrigin()), .orientation = {q.x(), q.y(), q.z(), q.w()}};
  if (body.getActivationState() == ISLAND_SLEEPING) return motion;
  motion.velocity = floats(body.getLinearVelocity());
  motion.angular_velocity = floats(body.getAngularVelocity());
  return motion;
}

void Physics::mark_touching(std::span<std::uint8_t> touching) const {
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(i);
    if (manifold->getNumContacts() == 0) continue;
    for (const btCollisionObject* body : {manifold->getBody0(), manifold->getBody1()}) {
      if (body->getUserIndex() != kSceneSlot) touching[static_cast<std::size_t>(body->getUserIndex())] = 1;
    }
  }
}

}  // namespace tandem::engine
