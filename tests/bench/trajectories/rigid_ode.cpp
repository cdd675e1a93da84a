// Records rigid bodies of the Open Dynamics Engine with their orientation. Usage: rigid_ode < plan > rows

#include <ode/ode.h>

#include <cmath>

#include "rigid_plan.hpp"

namespace {

struct Contacts {
  dWorldID world;
  dJointGroupID joints;
};

void collide(void* data, dGeomID a, dGeomID b) {
  const auto* contacts = static_cast<const Contacts*>(data);
  std::array<dContact, 8> found{};
  const int count = dCollide(a, b, static_cast<int>(found.size()), &found[0].geom, sizeof(dContact));
  for (int i = 0; i < count; ++i) {
    dContact& contact = found[static_cast<std::size_t>(i)];
    contact.surface.mode = dContactBounce | dContactApprox1;
    contact.surface.mu = 0.6;
    contact.surface.bounce = 0.05;
    contact.surface.bounce_vel = 0.5;
    dJointAttach(dJointCreateContact(contacts->world, contacts->joints, &contact), dGeomGetBody(a),
                 dGeomGetBody(b));
  }
}

// Gives the body its mass and its geometry. Capsules of ODE lie along z, ours along y.
void give_shape(dBodyID body, dSpaceID space, const recorder::Shape& shape, double mass) {
  const auto& v = shape.values;
  dMass m;
  if (shape.kind == 1) {
    dMassSetSphereTotal(&m, mass, v[0]);
    dGeomSetBody(dCreateSphere(space, v[0]), body);
  } else if (shape.kind == 2) {
    dMassSetBoxTotal(&m, mass, 2 * v[0], 2 * v[1], 2 * v[2]);
    dGeomSetBody(dCreateBox(space, 2 * v[0], 2 * v[1], 2 * v[2]), body);
  } else {
    dMassSetCapsuleTotal(&m, mass, 2, v[0], 2 * v[1]);
    const dGeomID geometry = dCreateCapsule(space, v[0], 2 * v[1]);
    dGeomSetBody(geometry, body);
    dMatrix3 upright;
    dRFromAxisAndAngle(upright, 1, 0, 0, M_PI / 2);
    dGeomSetOffsetRotation(geometry, upright);
  }
  dBodySetMass(body, &m);
}

}  // namespace

int main() {
  const recorder::RigidPlan plan = recorder::read_plan();
  dInitODE2(0);
  Contacts contacts{dWorldCreate(), dJointGroupCreate(0)};
  const dSpaceID space = dHashSpaceCreate(nullptr);
  dRandSetSeed(1);  // the order in which quick step visits its constraints
  dWorldSetMaxAngularSpeed(contacts.world, recorder::kMaxTurnPerS);
  dWorldSetAutoDisableFlag(contacts.world, plan.sleep ? 1 : 0);
  dWorldSetAutoDisableLinearThreshold(contacts.world, 0.1);
  dWorldSetAutoDisableAngularThreshold(contacts.world, 0.2);
  dWorldSetAutoDisableTime(contacts.world, 1);
  for (const recorder::Plane& p : plan.planes)
    dCreatePlane(space, p.normal[0], p.normal[1], p.normal[2], p.offset);
  std::vector<dBodyID> bodies;
  for (const recorder::Body& planned : plan.bodies) {
    const dBodyID body = dBodyCreate(contacts.world);
    give_shape(body, space, plan.shapes[planned.shape], planned.mass);
    dBodySetPosition(body, planned.at[0], planned.at[1], planned.at[2]);
    const dQuaternion turn{planned.turn[0], planned.turn[1], planned.turn[2], planned.turn[3]};
    dBodySetQuaternion(body, turn);
    bodies.push_back(body);
  }
  return recorder::record(
      plan,
      [&](const recorder::Vector& g) {
        for (const dBodyID body : bodies) dBodyEnable(body);
        dWorldSetGravity(contacts.world, g[0], g[1], g[2]);
      },
      [&](const recorder::Kick& kick) {
        for (const dBodyID body : bodies) {
          const dReal* p = dBodyGetPosition(body);
          if (std::hypot(p[0] - kick.centre[0], p[1] - kick.centre[1], p[2] - kick.centre[2]) > kick.radius)
            continue;
          dBodyEnable(body);
          const dReal* v = dBodyGetLinearVel(body);
          dBodySetLinearVel(body, v[0] + kick.change[0], v[1] + kick.change[1], v[2] + kick.change[2]);
        }
      },
      [&](double dt_s) {
        dSpaceCollide(space, &contacts, collide);
        dWorldQuickStep(contacts.world, dt_s);
        dJointGroupEmpty(contacts.joints);
      },
      [&] {
        for (const dBodyID body : bodies) {
          const dReal* p = dBodyGetPosition(body);
          const dReal* v = dBodyGetLinearVel(body);
          const dReal* q = dBodyGetQuaternion(body);
          const dReal* w = dBodyGetAngularVel(body);
          recorder::write_body(
              {p[0], p[1], p[2], v[0], v[1], v[2], q[0], q[1], q[2], q[3], w[0], w[1], w[2]});
        }
      });
}
