// Records the Open Dynamics Engine: rigid spheres in a room of six planes.
// Usage: ode < plan > rows

#include <ode/ode.h>

#include "plan.hpp"

namespace {

struct Contacts {
  dWorldID world;
  dJointGroupID joints;
};

void collide(void* data, dGeomID a, dGeomID b) {
  const auto* contacts = static_cast<const Contacts*>(data);
  std::array<dContact, 2> found{};
  const int count = dCollide(a, b, static_cast<int>(found.size()), &found[0].geom, sizeof(dContact));
  for (int i = 0; i < count; ++i) {
    dContact& contact = found[static_cast<std::size_t>(i)];
    contact.surface.mode = dContactBounce | dContactApprox1;
    contact.surface.mu = 0.5;
    contact.surface.bounce = 0.2;
    contact.surface.bounce_vel = 0.5;
    dJointAttach(dJointCreateContact(contacts->world, contacts->joints, &contact), dGeomGetBody(a),
                 dGeomGetBody(b));
  }
}

}  // namespace

int main() {
  const recorder::Plan plan = recorder::read_plan();
  dInitODE2(0);
  Contacts contacts{dWorldCreate(), dJointGroupCreate(0)};
  const dSpaceID space = dHashSpaceCreate(nullptr);
  dRandSetSeed(1);  // the order in which quick step visits its constraints
  for (std::size_t axis = 0; axis < 3; ++axis) {
    recorder::Vector normal{};
    normal[axis] = 1;
    dCreatePlane(space, normal[0], normal[1], normal[2], plan.low[axis]);
    dCreatePlane(space, -normal[0], -normal[1], -normal[2], -plan.high[axis]);
  }
  std::vector<dBodyID> bodies;
  for (const recorder::Vector& at : plan.start) {
    const dBodyID body = dBodyCreate(contacts.world);
    dMass mass;
    dMassSetSphereTotal(&mass, 1, plan.radius_m);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, at[0], at[1], at[2]);
    dGeomSetBody(dCreateSphere(space, plan.radius_m), body);
    bodies.push_back(body);
  }
  return recorder::record(
      plan,
      [&](const recorder::Vector& g, double dt_s) {
        dWorldSetGravity(contacts.world, g[0], g[1], g[2]);
        dSpaceCollide(space, &contacts, collide);
        dWorldQuickStep(contacts.world, dt_s);
        dJointGroupEmpty(contacts.joints);
      },
      [&] {
        for (const dBodyID body : bodies)
          recorder::write_body(dBodyGetPosition(body), dBodyGetLinearVel(body));
      });
}
