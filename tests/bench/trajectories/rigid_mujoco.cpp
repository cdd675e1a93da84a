// Records rigid bodies of MuJoCo with their orientation. Usage: rigid_mujoco < plan > rows

#include <mujoco/mujoco.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <string>

#include "rigid_plan.hpp"

namespace {

template <typename Numbers>
std::string listed(const Numbers& numbers) {
  std::ostringstream text;
  text.precision(12);
  for (const double number : numbers) text << number << ' ';
  return text.str();
}

// Capsules of MuJoCo lie along z, ours along y.
std::string geometry(const recorder::Shape& shape, double mass) {
  static constexpr const char* kTypes[] = {"", "sphere", "box", "capsule"};
  std::string text = "<geom type='" + std::string(kTypes[shape.kind]) + "' size='" + listed(shape.values) +
                     "' mass='" + std::to_string(mass) + "'";
  if (shape.kind == 3) text += " euler='90 0 0'";
  return text + "/>";
}

// A plane's x and y are a quarter of a turn about z away from each other, and its z is the normal.
std::string wall(const recorder::Plane& plane) {
  const recorder::Vector& n = plane.normal;
  return "<geom type='plane' size='0 0 1' zaxis='" + listed(n) + "' pos='" +
         listed(recorder::Vector{n[0] * plane.offset, n[1] * plane.offset, n[2] * plane.offset}) + "'/>";
}

std::string model_text(const recorder::RigidPlan& plan) {
  std::string text =
      "<mujoco><compiler angle='degree'/><size njmax='8000' nconmax='10000'/><option timestep='" +
      std::to_string(plan.dt_s / plan.substeps) +
      "' solver='CG' jacobian='sparse' cone='elliptic' iterations='15' tolerance='1e-6'/>"
      "<default><geom friction='0.6 0.005 0.0001' solref='0.017 1'/></default><worldbody>";
  for (const recorder::Plane& plane : plan.planes) text += wall(plane);
  for (const recorder::Body& body : plan.bodies) {
    text += "<body pos='" + listed(body.at) + "' quat='" + listed(body.turn) + "'><freejoint/>" +
            geometry(plan.shapes[body.shape], body.mass) + "</body>";
  }
  return text + "</worldbody></mujoco>";
}

template <typename Value, void (*kDelete)(Value*)>
struct Deleter {
  void operator()(Value* value) const { kDelete(value); }
};

}  // namespace

int main() {
  const recorder::RigidPlan plan = recorder::read_plan();
  const std::string text = model_text(plan);
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  const std::string name = "plan.xml";
  if (mj_makeEmptyFileVFS(files.get(), name.c_str(), static_cast<int>(text.size())) != 0) return 1;
  text.copy(static_cast<char*>(files->filedata[0]), text.size());
  std::string error(1000, '\0');
  const std::unique_ptr<mjModel, Deleter<mjModel, mj_deleteModel>> model(
      mj_loadXML(name.c_str(), files.get(), error.data(), static_cast<int>(error.size())));
  mj_deleteVFS(files.get());
  if (!model) {
    std::cerr << "MuJoCo refused the model: " << error.c_str() << "\n";
    return 1;
  }
  const std::unique_ptr<mjData, Deleter<mjData, mj_deleteData>> data(mj_makeData(model.get()));
  const std::size_t bodies = plan.bodies.size();
  // Of a free joint: three numbers of the place and a quaternion; velocity, and spin in the body's own axes.
  const auto spin = [&](std::size_t body) {
    recorder::Vector w{};
    mju_rotVecQuat(w.data(), data->qvel + 6 * body + 3, data->qpos + 7 * body + 3);
    return w;
  };
  return recorder::record(
      plan,
      [&](const recorder::Vector& g) { mju_copy3(model->opt.gravity, g.data()); },
      [&](const recorder::Kick& kick) {
        for (std::size_t body = 0; body < bodies; ++body) {
          const mjtNum* p = data->qpos + 7 * body;
          if (std::hypot(p[0] - kick.centre[0], p[1] - kick.centre[1], p[2] - kick.centre[2]) <= kick.radius)
            mju_addTo3(data->qvel + 6 * body, kick.change.data());
        }
      },
      [&](double) {
        mj_step(model.get(), data.get());
        for (std::size_t body = 0; body < bodies; ++body) {
          mjtNum* w = data->qvel + 6 * body + 3;
          const mjtNum speed = mju_norm3(w);
          if (speed > recorder::kMaxTurnPerS) mju_scl3(w, w, recorder::kMaxTurnPerS / speed);
        }
      },
      [&] {
        for (std::size_t body = 0; body < bodies; ++body) {
          const mjtNum* p = data->qpos + 7 * body;
          const mjtNum* v = data->qvel + 6 * body;
          const recorder::Vector w = spin(body);
          recorder::write_body(
              {p[0], p[1], p[2], v[0], v[1], v[2], p[3], p[4], p[5], p[6], w[0], w[1], w[2]});
        }
      });
}
