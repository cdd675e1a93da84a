#pragma once
// Agreed states of a recording as an engine would show its bodies.

#include <array>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/drive.hpp"
#include "tandem/simulation.hpp"

namespace tandem::lab {

/// Converts bodies from the lattice to scene units, seconds and radians.
class RecordedBodies {
 public:
  /// `lattice_unit` in scene units, `dt_s` seconds a frame.
  RecordedBodies(double lattice_unit, double dt_s) : unit_(lattice_unit), dt_s_(dt_s) {}

  /// Valid until the next call, and while `state` is as it is. Columns of turns are empty where it has none.
  [[nodiscard]] engine::Bodies of(const State& state);
  [[nodiscard]] engine::Vec3 gravity(const Drive& drive) const;
  [[nodiscard]] double damping_per_s(const Drive& drive) const;

 private:
  double unit_, dt_s_;
  std::array<std::vector<float>, 13> columns_;  // position, velocity, orientation, angular velocity
};

}  // namespace tandem::lab
