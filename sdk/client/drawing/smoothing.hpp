#pragma once
// How a correction is taken up: what is drawn keeps its place, beside the motion that it should follow, and
// comes back to it.

#include <cmath>

namespace tandem::client {

/// From the offset at one sample to that at the next, and to its velocity. The same for all bodies.
struct Smoothing {
  float place = 0;  ///< what is left of the offset
  float speed = 0;  ///< how fast it then goes away, per unit of time

  /// An offset that decays by 1/e in `constant` of any unit of time, after `elapsed` of it. With a constant
  /// of 0 nothing is left.
  [[nodiscard]] static Smoothing exponential(double elapsed, double constant) {
    if (!(constant > 0)) return {};
    const double left = std::exp(-elapsed / constant);
    return {static_cast<float>(left), static_cast<float>(-left / constant)};
  }
};

}  // namespace tandem::client
