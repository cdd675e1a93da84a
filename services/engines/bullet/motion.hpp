#pragma once
// Limits on a body's motion. Rigid bodies explode now and then; a session must survive it.

#include <cstdint>

#include "services/engines/bullet/world.hpp"

namespace tandem::engine {

struct Motion {
  Vec3f position{}, velocity{};
  Quaternion orientation{0, 0, 0, 1};
  Vec3f angular_velocity{};  ///< rad / s
};

/// Maximum difference of a quaternion's norm from 1.
inline constexpr float kNormSlack = 1e-3F;

[[nodiscard]] bool is_unit(const Quaternion& q);

enum class Condition : std::uint8_t { kFine, kClamped, kLost };

/// Bounds of positions, and of turning.
struct MotionLimits {
  Vec3f low{}, high{};
  float turn_per_s = 0;
};

/// kLost: a value is not a number, the orientation is not a rotation, or the centre is out of bounds.
/// kClamped: the body turned too fast, and now turns about the same axis at the limit.
[[nodiscard]] Condition mend(Motion& motion, const MotionLimits& limits);

/// The velocity with which a body of the given own speed begins a step of `dt_s`: as Cruise says. Without a
/// direction of flight it stays.
[[nodiscard]] Vec3f cruised(const Vec3f& position, const Vec3f& velocity, float own_speed,
                            const Cruise& cruise, float dt_s);

}  // namespace tandem::engine
