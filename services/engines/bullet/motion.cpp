#include "services/engines/bullet/motion.hpp"

#include <algorithm>
#include <cmath>

#include "services/engines/common/check.hpp"

namespace tandem::engine {
namespace {

bool is_finite(const Vec3f& v) {
  return std::ranges::all_of(v, [](float value) { return std::isfinite(value); });
}

}  // namespace

bool is_unit(const Quaternion& q) {
  const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return std::fabs(norm - 1) <= kNormSlack;  // false for what is not a number
}

Condition mend(Motion& motion, const MotionLimits& limits) {
  if (!inside(motion.position, limits.low, limits.high) || !is_unit(motion.orientation) ||
      !is_finite(motion.velocity) || !is_finite(motion.angular_velocity)) {
    return Condition::kLost;
  }
  Vec3f& w = motion.angular_velocity;
  // The largest component first: the square of a float may have no room.
  const float largest = std::max({std::fabs(w[0]), std::fabs(w[1]), std::fabs(w[2])});
  if (largest == 0) return Condition::kFine;
  const Vec3f scaled{w[0] / largest, w[1] / largest, w[2] / largest};
  const float length = std::sqrt(scaled[0] * scaled[0] + scaled[1] * scaled[1] + scaled[2] * scaled[2]);
  if (largest * length <= limits.turn_per_s) return Condition::kFine;
  for (std::size_t i = 0; i < 3; ++i) w[i] = scaled[i] / length * limits.turn_per_s;
  return Condition::kClamped;
}

}  // namespace tandem::engine
