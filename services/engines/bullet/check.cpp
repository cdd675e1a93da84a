#include "services/engines/bullet/check.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "services/engines/bullet/inputs.hpp"
#include "services/engines/common/check.hpp"

namespace tandem::engine {
namespace {

double length(const Vec3f& v) {
  double squared = 0;
  for (const float value : v) squared += static_cast<double>(value) * static_cast<double>(value);
  return std::sqrt(squared);
}

bool is_not_negative(float value) { return std::isfinite(value) && value >= 0; }

std::string fault(const Cruise& cruise, std::uint32_t capacity) {
  if (!(std::isfinite(cruise.radius) && cruise.radius > 0))
    return "the ball of bodies that cruise needs a radius above 0";
  if (!is_not_negative(cruise.acceleration) || !is_not_negative(cruise.return_acceleration))
    return "the accelerations of bodies that cruise must be finite and not negative";
  if (cruise.speed.size() != capacity || !std::ranges::all_of(cruise.speed, is_not_negative))
    return "every slot of bodies that cruise needs a finite speed of at least 0";
  return {};
}

// Checks the rules that particles do not have. Returns what is wrong; empty if nothing is.
std::string fault(const RigidWorld& rigid) {
  const EngineWorld& world = rigid.world;
  if (!world.emitters.empty() || !world.regions.empty())
    return "emitters and regions need the engine 'particles'";
  if (rigid.shapes.size() != world.types.size()) return "every type needs a shape";
  for (const Shape& shape : rigid.shapes) {
    if (auto good = check(shape); !good) return good.error().message;
  }
  if (!rigid.orientation.empty() && rigid.orientation.size() != world.start.size())
    return "either all bodies at the start have an orientation or none";
  if (!std::ranges::all_of(rigid.orientation, is_unit)) return "an orientation must have norm 1";
  if (!(rigid.friction >= 0 && rigid.friction <= 10)) return "friction must be 0 to 10";
  if (!(rigid.restitution >= 0 && rigid.restitution <= 1)) return "restitution must be 0 to 1";
  if (!rigid.spin.empty() && rigid.spin.size() != world.start.size())
    return "either all bodies at the start spin or none";
  for (const Vec3f& spin : rigid.spin) {
    if (!(length(spin) <= static_cast<double>(motion_limits(world).turn_per_s)))
      return "a body at the start turns too fast";
  }
  return rigid.cruise ? fault(*rigid.cruise, world.capacity) : std::string();
}

// Returns why the input is refused; empty if it may act. Comparisons are written so that NaN fails.
std::string refusal(const Spawn& spawn, const RigidWorld& rigid) {
  if (spawn.type >= rigid.shapes.size()) return "a body to spawn needs a type of the scene";
  if (!inside(spawn.position, rigid.world.low, rigid.world.high))
    return "a body to spawn must be within the bounds";
  if (!is_unit(spawn.orientation)) return "a body to spawn needs an orientation of norm 1";
  if (!(length(spawn.velocity) <= rigid.world.max_push)) return "a body to spawn is too fast";
  if (!(length(spawn.angular_velocity) <= static_cast<double>(motion_limits(rigid.world).turn_per_s)))
    return "a body to spawn turns too fast";
  return {};
}

std::string refusal(const Remove& remove, const RigidWorld& rigid) {
  if (!inside(remove.centre, rigid.world.low, rigid.world.high))
    return "a place to clear must be within the bounds";
  if (!(remove.radius > 0 && std::isfinite(remove.radius))) return "a place to clear needs a radius above 0";
  return {};
}

}  // namespace

Result<void> check(const RigidWorld& world) {
  if (auto good = check(world.world); !good) return good;
  if (std::string reason = fault(world); !reason.empty())
    return fail(ErrorCode::kInvalidArgument, std::move(reason));
  return {};
}

MotionLimits motion_limits(const EngineWorld& world) {
  // A little less than the limit, so that it also holds after rounding.
  return {world.low, world.high, 0.9999F * static_cast<float>(kMaxTurn) / world.dt_s};
}

Classification classify_input(const Input& input, const RigidWorld& world) {
  if (input.kind != static_cast<std::uint32_t>(InputKind::kApplication))
    return classify_input(input, world.world);
  Classification result;
  if (!input.values.empty()) {
    result.reason = "an application input takes bytes alone";
  } else if (const auto spawn = spawn_of(input.bytes)) {
    result.reason = refusal(*spawn, world);
  } else if (const auto remove = remove_of(input.bytes)) {
    result.reason = refusal(*remove, world);
  } else {
    result.reason = "the bytes say neither spawn nor remove";
  }
  if (result.reason.empty()) result.effect = Classification::Effect::kImmediate;
  return result;
}

}  // namespace tandem::engine
