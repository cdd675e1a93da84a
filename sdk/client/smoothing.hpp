#pragma once
// How a correction is taken up: what is drawn keeps its place, beside the motion that it should follow, and
// comes back to it.

#include <cmath>

namespace tandem::client {

/// From the offset and its velocity at one sample to those at the next. Linear, so that it is worked out once
/// for all bodies.
struct Smoothing {
  float place_of_place = 0, place_of_speed = 0;
  float speed_of_place = 0, speed_of_speed = 0;

  /// An offset that decays by 1/e in `constant` of any unit of time, after `elapsed` of it; its velocity per
  /// unit. With a constant of 0 nothing is left.
  [[nodiscard]] static Smoothing exponential(double elapsed, double constant) {
    if (!(constant > 0)) return {};
    const double left = std::exp(-elapsed / constant);
    return {static_cast<float>(left), 0, static_cast<float>(-left / constant), 0};
  }

  /// As of a critically damped spring, which keeps the velocity too. Its rate is 2 / `constant`, so that the
  /// area below the offset after a jump is that of exponential().
  [[nodiscard]] static Smoothing spring(double elapsed, double constant) {
    if (!(constant > 0)) return {};
    const double rate = 2 / constant;
    const double left = std::exp(-elapsed * rate);
    return {static_cast<float>(left * (1 + rate * elapsed)), static_cast<float>(left * elapsed),
            static_cast<float>(-left * rate * rate * elapsed),
            static_cast<float>(left * (1 - rate * elapsed))};
  }
};

}  // namespace tandem::client
