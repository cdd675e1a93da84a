#pragma once
// Blends in a correction: the drawn body keeps its place beside the corrected motion and then returns to it.

#include <cmath>

namespace tandem::client {

/// The step from the offset at one sample to the offset and its velocity at the next. The same for all
/// bodies.
struct Smoothing {
  float place = 0;  ///< the part of the offset that remains
  float speed = 0;  ///< its rate of change then, per unit of time

  /// An offset that decays to 1/e in the time `constant`, after the time `elapsed`, both in the same unit.
  /// With a constant of 0 nothing remains.
  [[nodiscard]] static Smoothing exponential(double elapsed, double constant) {
    if (!(constant > 0)) return {};
    const double left = std::exp(-elapsed / constant);
    return {static_cast<float>(left), static_cast<float>(-left / constant)};
  }
};

}  // namespace tandem::client
