#include "services/engines/common/check.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace tandem::engine {
namespace {

constexpr float kFar = 1e6F;  // farther out, a float's spacing is coarser than a body moves

bool sane(float value) { return std::isfinite(value) && std::fabs(value) <= kFar; }
bool sane(const Vec3f& v) { return sane(v[0]) && sane(v[1]) && sane(v[2]); }
bool positive(float value) { return sane(value) && value > 0; }
bool not_negative(float value) { return sane(value) && value >= 0; }
bool ordered(const Vec3f& low, const Vec3f& high) {
  return sane(low) && sane(high) && low[0] <= high[0] && low[1] <= high[1] && low[2] <= high[2];
}
float dot(const Vec3f& a, const Vec3f& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
bool unit(const Vec3f& v) { return sane(v) && std::fabs(dot(v, v) - 1) < 1e-4F; }
bool sane(const Material& m) {
  return not_negative(m.spring) && not_negative(m.damping) && not_negative(m.shear);
}

bool sane(const Box& box) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (!positive(box.half[i]) || !unit(box.axes[i])) return false;
    if (std::fabs(dot(box.axes[i], box.axes[(i + 1) % 3])) > 1e-4F) return false;
  }
  return sane(box.centre);
}

// Returns what is wrong; empty if nothing is.
std::string fault(const EngineWorld& world) {
  const std::size_t types = world.types.size();
  if (world.capacity == 0 || world.capacity > kMaxBodies) {
    return "the number of bodies must be 1 to " + std::to_string(kMaxBodies);
  }
  if (!positive(world.dt_s) || world.dt_s > 1) return "dt must be above 0 and at most 1 s";
  if (world.substeps == 0 || world.substeps > 64) return "substeps must be 1 to 64";
  if (!sane(world.gravity)) return "gravity must be finite";
  if (!not_negative(world.damping_per_s) || !(world.damping_per_s * world.dt_s < 1)) {
    return "damping must be at least 0 and take less than all of the velocity in a step";
  }
  if (!ordered(world.low, world.high)) return "bounds must be finite and low below high";
  if (!sane(world.pair) || !sane(world.wall)) return "material constants must be finite and not negative";
  if (types == 0 || types > 65535) return "there must be 1 to 65535 types";
  for (const ParticleType& type : world.types) {
    if (!positive(type.radius) || !positive(type.mass)) return "a type's radius and mass must be above 0";
  }
  for (const Plane& plane : world.planes) {
    if (!unit(plane.normal) || !sane(plane.offset)) return "a plane needs a unit normal and a finite offset";
  }
  for (const Box& box : world.boxes) {
    if (!sane(box)) return "a box needs a finite centre, sizes above 0 and orthonormal axes";
  }
  for (const Ball& ball : world.balls) {
    if (!sane(ball.centre) || !positive(ball.radius))
      return "a sphere needs a finite centre and a radius above 0";
  }
  if (world.start.size() > world.capacity) return "more bodies at the start than slots";
  for (const StartBody& body : world.start) {
    if (!sane(body.position) || !sane(body.velocity) || body.type >= types)
      return "a body at the start is invalid";
    if (!inside(body.position, world.low, world.high)) return "a body starts outside the bounds";
  }
  for (const Emitter& emitter : world.emitters) {
    if (!ordered(emitter.low, emitter.high) || !sane(emitter.velocity) || emitter.type >= types ||
        !(emitter.rate_per_s >= 0 && emitter.rate_per_s <= 1e6) ||
        !inside(emitter.low, world.low, world.high) || !inside(emitter.high, world.low, world.high)) {
      return "an emitter must lie within the bounds, with a known type and a rate of 0 to 1e6 a second";
    }
  }
  if (!(world.push_budget >= 0)) return "the budget of pushes must not be negative";
  if (!(world.sleep_speed >= 0)) return "the speed below which bodies sleep must not be negative";
  for (const Region& region : world.regions) {
    if (!ordered(region.low, region.high) || !sane(region.offset) || region.type >= types)
      return "a region needs a known type";
  }
  return {};
}

Classification refuse(std::string reason) {
  Classification result;
  result.reason = std::move(reason);
  return result;
}

bool within(std::span<const double> values, double limit) {
  double squared = 0;
  for (const double v : values) squared += v * v;
  return squared <= limit * limit;  // false for what is not a number
}

}  // namespace

Result<void> check(const EngineWorld& world) {
  if (std::string reason = fault(world); !reason.empty())
    return fail(ErrorCode::kInvalidArgument, std::move(reason));
  return {};
}

Classification classify_input(const Input& input, const EngineWorld& world) {
  const std::span<const double> values(input.values);
  Classification result;
  if (!input.bytes.empty()) return refuse("this engine takes no bytes");
  switch (static_cast<InputKind>(input.kind)) {
    case InputKind::kGravity:
      if (values.size() != 3) return refuse("gravity takes 3 values");
      if (!within(values, world.max_gravity))
        return refuse("gravity is not finite or beyond the scene's limit");
      result.effect = Classification::Effect::kScheduled;
      result.gravity = {values[0], values[1], values[2]};
      result.damping_per_s = static_cast<double>(world.damping_per_s);
      return result;
    case InputKind::kPush:
      if (values.size() != 7) return refuse("a push takes 7 values");
      if (!within(values.first(4), static_cast<double>(kFar)))
        return refuse("a push's place is not finite or far away");
      if (!(values[3] > 0)) return refuse("a push's radius must be above 0");
      if (!within(values.subspan(4), world.max_push))
        return refuse("a push is not finite or beyond the scene's limit");
      result.effect = Classification::Effect::kImmediate;
      return result;
    case InputKind::kSeek:
      return refuse("this is no recording");
    case InputKind::kApplication:
      return refuse("this engine takes no application input");
  }
  return refuse("unknown kind of input");
}

InputBudget input_budget(const EngineWorld& world) {
  if (!(world.push_budget > 0)) return {};
  return {.per_second = world.push_budget, .most = std::max(world.max_push, world.push_budget)};
}

double push_cost(const Input& input, const Bodies& bodies) {
  if (input.kind != static_cast<std::uint32_t>(InputKind::kPush)) return 0;
  const std::size_t capacity = bodies.alive.size();
  const std::size_t stride = 1 + (capacity - std::min<std::size_t>(capacity, 1)) / kCountedBodies;
  std::size_t alive = 0, reached = 0;
  for (std::size_t slot = 0; slot < capacity; slot += stride) {
    if (bodies.alive[slot] == 0) continue;
    ++alive;
    double squared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double d = static_cast<double>(bodies.position[i][slot]) - input.values[i];
      squared += d * d;
    }
    reached += squared <= input.values[3] * input.values[3] ? 1U : 0U;
  }
  const double share =
      static_cast<double>(reached) / static_cast<double>(std::max<std::size_t>(alive, kFewBodies));
  double change = 0;
  for (std::size_t i = 4; i < 7; ++i) change += input.values[i] * input.values[i];
  return std::sqrt(change) * std::max(share, kLeastShare);
}

}  // namespace tandem::engine
