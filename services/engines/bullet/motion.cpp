#include "services/engines/bullet/motion.hpp"

#include <algorithm>
#include <cmath>

#include "services/engines/common/check.hpp"

namespace tandem::engine {
namespace {

constexpr float kLeastDirected = 1e-6F;  // m/s; below this a velocity has no direction
constexpr float kSpeedSlack = 1e-4F;     // m/s; far above what rounding makes of a speed

float norm_of(const Vec3f& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

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
  const float norm = norm_of(scaled);
  if (largest * norm <= limits.turn_per_s) return Condition::kFine;
  for (std::size_t i = 0; i < 3; ++i) w[i] = scaled[i] / norm * limits.turn_per_s;
  return Condition::kClamped;
}

Vec3f cruised(const Vec3f& position, const Vec3f& velocity, float own_speed, const Cruise& cruise,
              float dt_s) {
  // What `scale` times `along` adds to the velocity.
  const auto changed = [&velocity](const Vec3f& along, float scale) {
    return Vec3f{velocity[0] + scale * along[0], velocity[1] + scale * along[1],
                 velocity[2] + scale * along[2]};
  };
  const float distance = norm_of(position);
  if (distance > cruise.radius) return changed(position, -cruise.return_acceleration * dt_s / distance);
  const float speed = norm_of(velocity);
  const float max_change = cruise.acceleration * dt_s;
  // A body at its speed keeps its bits: rounding would change them in each step.
  if (speed <= kLeastDirected || std::fabs(speed - own_speed) <= kSpeedSlack) return velocity;
  return changed(velocity, std::clamp(own_speed - speed, -max_change, max_change) / speed);
}

}  // namespace tandem::engine
