#include "services/engine/particles/contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tandem::engine {
namespace {

Float3 to_float3(const Vec3f& v) { return {v[0], v[1], v[2]}; }
Float3 position(const Record& r) { return {r.x, r.y, r.z}; }
Float3 velocity(const Record& r) { return {r.vx, r.vy, r.vz}; }

// S. Green 2008: -spring * overlap * n + damping * u + shear * (u - (u.n) n), with u written once.
Float3 penalty(const Material& material, float overlap, Float3 n, Float3 u) {
  const float along = material.spring * overlap + material.shear * dot(u, n);
  return (material.damping + material.shear) * u - along * n;
}

// Where a body touches a surface: how deep, and the unit vector from the body's centre into the surface.
struct Touch {
  float overlap = 0;
  Float3 into;
};

Touch touch(const Plane& plane, Float3 p, float radius) {
  const Float3 n = to_float3(plane.normal);
  return {radius - (dot(n, p) - plane.offset), -1.0F * n};
}

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
  if (inside) {  // out through the nearest face, the first of equals
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

template <class Shapes>
void add_touches(const Shapes& shapes, const Material& material, const Record& body, Contact& sum) {
  for (const auto& shape : shapes) {
    const Touch t = touch(shape, position(body), body.radius);
    if (!(t.overlap > 0)) continue;
    sum.force = sum.force + penalty(material, t.overlap, t.into, -1.0F * velocity(body));
    sum.touching = true;
  }
}

// Adds the contacts of records[self] with its neighbours. Two passes, because the first has no branch to
// mispredict.
void add_neighbours(const Material& material, std::span<const Record> records, std::uint32_t self,
                    const Neighbourhood& around, Contact& sum) {
  std::uint32_t near[kMaxCandidates];
  const Record body = records[self];
  std::uint32_t count = 0;
  std::uint32_t allowed = kMaxCandidates;
  for (std::uint32_t r = 0; r < around.count; ++r) {
    const std::uint32_t begin = around.runs[r].begin;
    const std::uint32_t end = begin + std::min(allowed, around.runs[r].end - begin);
    for (std::uint32_t j = begin; j < end; ++j) {
      const Float3 d = position(records[j]) - position(body);
      const float reach = body.radius + records[j].radius;
      near[count] = j;
      count += static_cast<std::uint32_t>(dot(d, d) < reach * reach);
    }
    allowed -= end - begin;
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t j = near[k];
    if (j == self) continue;
    const Float3 d = position(records[j]) - position(body);
    const float distance = std::sqrt(dot(d, d));
    // Two bodies in one point part along y, the earlier one downwards.
    const Float3 n = distance > 0 ? (1.0F / distance) * d : Float3{0, j > self ? 1.0F : -1.0F, 0};
    const float overlap = body.radius + records[j].radius - distance;
    sum.force = sum.force + penalty(material, overlap, n, velocity(records[j]) - velocity(body));
    sum.touching = true;
  }
}

}  // namespace

Contact scene_contact(const World& world, const Record& body) {
  Contact sum;
  add_touches(world.planes, world.wall, body, sum);
  add_touches(world.boxes, world.wall, body, sum);
  add_touches(world.balls, world.wall, body, sum);
  return sum;
}

void sum_contacts(const World& world, const Grid& grid, std::uint32_t begin, std::uint32_t end,
                  std::span<Contact> contacts) {
  const std::span<const Record> records = grid.sorted();
  Neighbourhood near;
  std::uint32_t near_cell = UINT32_MAX;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Record& body = records[i];
    const std::uint32_t cell = grid.cell_of(body.x, body.y, body.z);
    if (cell != near_cell) {
      near = grid.neighbourhood(cell);
      near_cell = cell;
    }
    Contact sum = scene_contact(world, body);
    add_neighbours(world.pair, records, i, near, sum);
    contacts[body.slot] = sum;
  }
}

}  // namespace tandem::engine
