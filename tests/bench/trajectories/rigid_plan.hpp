#pragma once
// The input of a recorder of rigid bodies on standard input, as text: shapes, bodies, the gravity of each row
// and kicks, made by `rigid.py` so that every engine gets the same. What it answers on standard output:
// float32 [frames + 1][bodies][13], position, velocity, quaternion w x y z, angular velocity.

#include <array>
#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <vector>

namespace recorder {

using Vector = std::array<double, 3>;

/// A body turns by at most this in a row of 1/30 s, as recordings must.
inline constexpr double kMaxTurnPerS = 57;

struct Shape {
  int kind = 0;  ///< 1 sphere: radius; 2 box: half sizes; 3 capsule: radius, half length along y
  std::vector<double> values;
};

struct Body {
  std::size_t shape = 0;
  double mass = 1;
  Vector at{};
  std::array<double, 4> turn{};  ///< w, x, y, z
};

/// Plane: dot(normal, p) >= offset.
struct Plane {
  Vector normal{};
  double offset = 0;
};

/// Adds to the velocity of every body within the radius, before the step that leads to row `frame`.
struct Kick {
  std::size_t frame = 0;
  Vector centre{};
  double radius = 0;
  Vector change{};
};

struct RigidPlan {
  double dt_s = 0;
  int substeps = 1;
  bool sleep = false;
  std::vector<Plane> planes;
  std::vector<Shape> shapes;
  std::vector<Body> bodies;
  std::vector<Kick> kicks;
  std::vector<Vector> gravity;  ///< [0] leads to row 1
};

inline std::istream& operator>>(std::istream& in, Vector& v) { return in >> v[0] >> v[1] >> v[2]; }
inline std::istream& operator>>(std::istream& in, Plane& p) { return in >> p.normal >> p.offset; }
inline std::istream& operator>>(std::istream& in, Kick& k) {
  return in >> k.frame >> k.centre >> k.radius >> k.change;
}
inline std::istream& operator>>(std::istream& in, Body& b) {
  return in >> b.shape >> b.mass >> b.at >> b.turn[0] >> b.turn[1] >> b.turn[2] >> b.turn[3];
}

/// A count, then as many items. Leaves the stream failed when the count is too large.
template <class T>
std::istream& operator>>(std::istream& in, std::vector<T>& items) {
  std::size_t count = 0;
  if (in >> count && count > 100'000) in.setstate(std::ios::failbit);
  if (!in) return in;
  items.resize(count);
  for (T& item : items) in >> item;
  return in;
}
inline std::istream& operator>>(std::istream& in, Shape& s) { return in >> s.kind >> s.values; }

/// Ends the program when the plan is not whole.
inline RigidPlan read_plan() {
  RigidPlan plan;
  std::cin >> plan.dt_s >> plan.substeps >> plan.sleep >> plan.planes >> plan.shapes >> plan.bodies >>
      plan.kicks >> plan.gravity;
  bool good = std::cin && !plan.bodies.empty() && plan.substeps >= 1;
  for (const Body& body : plan.bodies) good = good && body.shape < plan.shapes.size();
  for (const Shape& s : plan.shapes) {
    good = good && s.kind >= 1 && s.kind <= 3 &&
           s.values.size() == std::array<std::size_t, 4>{0, 1, 3, 2}[static_cast<std::size_t>(s.kind)];
  }
  if (!good) {
    std::cerr << "expected a plan on standard input, as tests/bench/trajectories/rigid.py writes it\n";
    std::exit(2);
  }
  return plan;
}

/// One body of the next row.
inline void write_body(const std::array<double, 13>& values) {
  std::array<float, 13> row{};
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = static_cast<float>(values[i]);
  std::cout.write(static_cast<const char*>(static_cast<const void*>(row.data())), sizeof row);
}

/// Runs the plan: `set_gravity(gravity)` where it changes, `kick(kick)`, `step(dt_s)` a sub-step, `write()` a
/// row.
template <typename SetGravity, typename KickBodies, typename Step, typename Write>
int record(const RigidPlan& plan, const SetGravity& set_gravity, const KickBodies& kick, const Step& step,
           const Write& write) {
  write();
  for (std::size_t frame = 0; frame < plan.gravity.size(); ++frame) {
    if (frame == 0 || plan.gravity[frame] != plan.gravity[frame - 1]) set_gravity(plan.gravity[frame]);
    for (const Kick& one : plan.kicks) {
      if (one.frame == frame + 1) kick(one);
    }
    for (int i = 0; i < plan.substeps; ++i) step(plan.dt_s / plan.substeps);
    write();
  }
  std::cout.flush();
  return std::cout ? 0 : 1;
}

}  // namespace recorder
