#pragma once
// Drawn orientations. They are floats and never enter the agreed state. The functions are inline because
// sampling calls about a dozen for each body.

#include <array>
#include <cmath>
#include <cstddef>

#include "sdk/core/lattice/turn.hpp"

namespace tandem::client {

/// A quaternion x, y, z, w of norm 1. q and -q are the same orientation, and every function takes either.
using Rotation = std::array<float, 4>;

[[nodiscard]] inline float dot(const Rotation& a, const Rotation& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/// Scales `q` to norm 1 within float's precision. `q` must not be 0.
[[nodiscard]] inline Rotation normalised(const Rotation& q) {
  const float scale = 1 / std::sqrt(dot(q, q));
  return {q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale};
}

/// Converts a valid quaternion.
[[nodiscard]] inline Rotation to_rotation(const Quaternion& q) {
  constexpr float kScale = 1.0F / kQuaternionOne;
  return normalised({kScale * static_cast<float>(q[0]), kScale * static_cast<float>(q[1]),
                     kScale * static_cast<float>(q[2]), kScale * static_cast<float>(q[3])});
}

/// Interpolates from `a` (share 0) to `b` (share 1) the shorter way at a constant rate (slerp). If the two
/// are less than 0.1 rad apart, it interpolates along the chord instead of the arc, which needs no sine. With
/// a the angle, the error at share t is a^3 / 24 t (1 - t) (1 - 2 t), at most 4e-6 rad.
[[nodiscard]] inline Rotation between(const Rotation& a, const Rotation& b, float share) {
  constexpr float kClose = 0.99875F;  // cosine of half of 0.1 rad
  const float cosine = dot(a, b);
  float of_a = 1 - share, of_b = share;
  if (std::abs(cosine) < kClose) {
    const float angle = std::acos(std::abs(cosine));
    of_a = std::sin(angle * of_a);
    of_b = std::sin(angle * of_b);
  }
  if (cosine < 0) of_b = -of_b;
  Rotation r{};
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = of_a * a[i] + of_b * b[i];
  return normalised(r);
}

/// `q` after `frames` frames, -2 .. 2, at the angular velocity `spin`.
[[nodiscard]] inline Rotation turned_on(const Rotation& q, const Spin& spin, float frames) {
  if (spin == Spin{}) return q;  // true for most bodies of most scenes
  constexpr float kHalfSpin = 0.5F / (1 << 28);
  const float half = kHalfSpin * frames;
  float x = static_cast<float>(spin[0]) * half;
  float y = static_cast<float>(spin[1]) * half;
  float z = static_cast<float>(spin[2]) * half;
  // h is the square of half the angle, which is at most 2 rad. w becomes its cosine, `sine` its sine divided
  // by it. The series end where the next term is below 2e-8.
  const float h = x * x + y * y + z * z;
  float w = 1, sine = 1;
  for (const float d : {210.0F, 156.0F, 110.0F, 72.0F, 42.0F, 20.0F, 6.0F}) sine = 1 - sine * (h * (1 / d));
  for (const float d : {240.0F, 182.0F, 132.0F, 90.0F, 56.0F, 30.0F, 12.0F, 2.0F}) w = 1 - w * (h * (1 / d));
  x *= sine;
  y *= sine;
  z *= sine;
  return normalised({w * q[0] + x * q[3] + y * q[2] - z * q[1], w * q[1] - x * q[2] + y * q[3] + z * q[0],
                     w * q[2] + x * q[1] - y * q[0] + z * q[3], w * q[3] - x * q[0] - y * q[1] - z * q[2]});
}

}  // namespace tandem::client
