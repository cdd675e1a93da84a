#include "services/engines/particles/surfaces.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "services/engines/particles/vec.hpp"

namespace tandem::engine {
namespace {

Float3 to_float3(const Vec3f& v) { return {v[0], v[1], v[2]}; }

// A touch of a body and a surface: its depth, and the unit vector from the body's centre into the surface.
struct Touch {
  float overlap = 0;
  Float3 into;
};

Touch touch(const Ball& ball, Float3 p, float radius) {
  const Float3 d = to_float3(ball.centre) - p;
  const float reach = ball.radius + radius;
  const float squared = dot(d, d);
  if (squared >= reach * reach) return {};
  const float distance = std::sqrt(squared);
  return {reach - distance, distance > 0 ? (1.0F / distance) * d : Float3{0, -1, 0}};
}

Touch touch(const Box& box, Float3 p, float radius) {
  const Float3 d = p - to_float3(box.centre);
  std::array<float, 3> local{};
  std::array<float, 3> outside{};
  bool inside = true;
  for (std::size_t i = 0; i < 3; ++i) {
    local[i] = dot(to_float3(box.axes[i]), d);
    const float clamped = std::clamp(local[i], -box.half[i], box.half[i]);
    outside[i] = local[i] - clamped;
    if (outside[i] > radius || outside[i] < -radius) return {};
    if (outside[i] != 0) inside = false;
  }
  const auto to_scene = [&box](const std::array<float, 3>& v) {
    return v[0] * to_float3(box.axes[0]) + v[1] * to_float3(box.axes[1]) + v[2] * to_float3(box.axes[2]);
  };
  if (inside) {  // pushed out through the nearest face, the first of equally near ones
    std::size_t nearest = 0;
    std::array<float, 3> depth{};
    for (std::size_t i = 0; i < 3; ++i) {
      depth[i] = box.half[i] - std::fabs(local[i]);
      if (depth[i] < depth[nearest]) nearest = i;
    }
    std::array<float, 3> into{};
    into[nearest] = local[nearest] < 0 ? 1.0F : -1.0F;
    return {radius + depth[nearest], to_scene(into)};
  }
  const float squared = outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2];
  if (squared >= radius * radius) return {};
  const float distance = std::sqrt(squared);
  return {radius - distance, (-1.0F / distance) * to_scene(outside)};
}

template <class Shape>
void add_touch(const Shape& shape, const Material& m, const Record* records, std::uint32_t first,
               Sums& sums) {
  for (std::uint32_t i = 0; i < kGroup; ++i) {
    const Record& body = records[first + i];
    const Touch t = touch(shape, {body.x, body.y, body.z}, body.radius);
    if (!(t.overlap > 0)) continue;
    const Float3 u{-1.0F * body.vx, -1.0F * body.vy, -1.0F * body.vz};
    const float along = m.spring * t.overlap + m.shear * dot(u, t.into);
    const Float3 force = (m.damping + m.shear) * u - along * t.into;
    sums.x[i] += force.x;
    sums.y[i] += force.y;
    sums.z[i] += force.z;
    sums.touching |= 1U << i;
  }
}

}  // namespace

Surfaces::Surfaces(const EngineWorld& world) : boxes_(world.boxes), balls_(world.balls), wall_(world.wall) {
  constexpr float kSlack = 1.01F;  // for rounding
  float radius = 0;
  for (const ParticleType& type : world.types) radius = std::max(radius, type.radius);
  const auto extent = [&](const Vec3f& centre, const Vec3f& half) {
    Extent e;
    for (std::size_t i = 0; i < 3; ++i) {
      e.low[i] = centre[i] - kSlack * (half[i] + radius);
      e.high[i] = centre[i] + kSlack * (half[i] + radius);
    }
    return e;
  };
  for (const Box& box : boxes_) {
    Vec3f half{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t i = 0; i < 3; ++i) half[i] += box.half[axis] * std::fabs(box.axes[axis][i]);
    box_extents_.push_back(extent(box.centre, half));
  }
  for (const Ball& ball : balls_)
    ball_extents_.push_back(extent(ball.centre, {ball.radius, ball.radius, ball.radius}));
}

bool Surfaces::near(const Extent& a, const Extent& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (a.low[i] > b.high[i] || b.low[i] > a.high[i]) return false;
  }
  return true;
}

void Surfaces::add(const Record* records, std::uint32_t first, Sums& sums) const {
  Extent group{{kNowhere, kNowhere, kNowhere}, {-kNowhere, -kNowhere, -kNowhere}};
  for (std::uint32_t i = 0; i < kGroup; ++i) {
    const Record& r = records[first + i];
    const Vec3f p{r.x, r.y, r.z};
    if (r.slot == kNoSlot) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      group.low[axis] = std::min(group.low[axis], p[axis]);
      group.high[axis] = std::max(group.high[axis], p[axis]);
    }
  }
  for (std::size_t i = 0; i < boxes_.size(); ++i)
    if (near(group, box_extents_[i])) add_touch(boxes_[i], wall_, records, first, sums);
  for (std::size_t i = 0; i < balls_.size(); ++i)
    if (near(group, ball_extents_[i])) add_touch(balls_[i], wall_, records, first, sums);
}

}  // namespace tandem::engine
