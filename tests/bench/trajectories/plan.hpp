#pragma once
// The input of a recorder on standard input, as text: one start position per body and one gravity per step,
// made by `generate` so that every engine gets the same. What it answers on standard output: float32 [frames
// + 1][bodies][6], position and velocity.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <vector>

namespace recorder {

using Vector = std::array<double, 3>;

struct Plan {
  double dt_s = 0, radius_m = 0;
  int substeps = 1;
  Vector low{}, high{};  ///< of the room
  std::vector<Vector> start;
  std::vector<Vector> gravity;  ///< [0] leads to row 1
};

inline std::istream& operator>>(std::istream& in, Vector& v) { return in >> v[0] >> v[1] >> v[2]; }

/// Ends the program when the plan is not whole.
inline Plan read_plan() {
  Plan plan;
  std::size_t bodies = 0, frames = 0;
  std::cin >> bodies >> frames >> plan.dt_s >> plan.substeps >> plan.radius_m >> plan.low >> plan.high;
  if (std::cin && bodies <= 100'000 && frames <= 100'000) {
    plan.start.resize(bodies);
    plan.gravity.resize(frames);
    for (Vector& v : plan.start) std::cin >> v;
    for (Vector& v : plan.gravity) std::cin >> v;
  }
  if (!std::cin || plan.start.empty() || plan.substeps < 1) {
    std::cerr << "expected a plan on standard input, as tests/bench/trajectories/generate writes it\n";
    std::exit(2);
  }
  return plan;
}

/// One body of the next row.
template <typename Position, typename Velocity>
void write_body(const Position& p, const Velocity& v) {
  const std::array<float, 6> row{static_cast<float>(p[0]), static_cast<float>(p[1]),
                                 static_cast<float>(p[2]), static_cast<float>(v[0]),
                                 static_cast<float>(v[1]), static_cast<float>(v[2])};
  std::cout.write(static_cast<const char*>(static_cast<const void*>(row.data())), sizeof row);
}

/// Runs the plan: `step(gravity, dt_s)` makes a sub-step, `write()` a row.
template <typename Step, typename Write>
int record(const Plan& plan, const Step& step, const Write& write) {
  write();
  for (const Vector& gravity : plan.gravity) {
    for (int i = 0; i < plan.substeps; ++i) step(gravity, plan.dt_s / plan.substeps);
    write();
  }
  std::cout.flush();
  return std::cout ? 0 : 1;
}

}  // namespace recorder
