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

// A touch of a body and a surface: its depth, and the unit vector from the body's centre into the surface.
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

template <class Shapes>
void add_touches(const Shapes& shapes, const Material& material, const Record& body, Contact& sum) {
  for (const auto& shape : shapes) {
    const Touch t = touch(shape, position(body), body.radius);
    if (!(t.overlap > 0)) continue;
    sum.force = sum.force + penalty(material, t.overlap, t.into, -1.0F * velocity(body));
    sum.touching = true;
  }
}

// The bodies of a range of records that may touch one body.
class Partners {
 public:
  // Collects the bodies of [from, to) around `self` that may touch it. No branch in the loop to mispredict.
  void collect(std::span<const Record> records, const Neighbourhood& around, const Record& self,
               std::uint32_t from, std::uint32_t to) {
    count_ = 0;
    for (std::uint32_t r = 0; r < around.count; ++r) {
      const std::uint32_t end = std::min(around.runs[r].end, to);
      for (std::uint32_t j = std::max(around.runs[r].begin, from); j < end; ++j) {
        const Float3 d = position(records[j]) - position(self);
        const float reach = self.radius + records[j].radius;
        places_[count_] = j;
        count_ += static_cast<std::uint32_t>(dot(d, d) < reach * reach);
      }
    }
  }
  [[nodiscard]] std::span<const std::uint32_t> places() const { return {places_.data(), count_}; }

 private:
  std::array<std::uint32_t, kMaxNeighbours + 1> places_{};  // one more, for the write before the count
  std::uint32_t count_ = 0;
};

// The force of `other` on `self`, which lies before it. The force on `other` is exactly the negative.
inline Float3 pair_force(const Material& material, const Record& self, const Record& other) {
  const Float3 d = position(other) - position(self);
  const float distance = std::sqrt(dot(d, d));
  // Two bodies at the same point separate along y, the earlier one downwards.
  const Float3 n = distance > 0 ? (1.0F / distance) * d : Float3{0, 1, 0};
  const float overlap = self.radius + other.radius - distance;
  return penalty(material, overlap, n, velocity(other) - velocity(self));
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
                  std::span<Contact> sums) {
  const std::span<const Record> records = grid.sorted();
  const std::uint32_t last = grid.in_cells();
  for (std::uint32_t i = begin; i < end; ++i) sums[i] = scene_contact(world, records[i]);

  Partners partners;
  Neighbourhood around;
  std::uint32_t around_cell = UINT32_MAX;
  const auto look_around = [&](const Record& body, bool later_only) {
    const std::uint32_t cell = grid.cell_of(body.x, body.y, body.z);
    if (cell != around_cell) around = grid.neighbourhood(cell, later_only);
    around_cell = cell;
  };
  // Partners before the range come first, because they have the lowest places.
  for (std::uint32_t i = begin; begin > 0 && i < std::min(end, last); ++i) {
    look_around(records[i], false);
    partners.collect(records, around, records[i], 0, begin);
    for (const std::uint32_t j : partners.places()) {
      sums[i].force = sums[i].force - pair_force(world.pair, records[j], records[i]);
      sums[i].touching = true;
    }
  }
  around_cell = UINT32_MAX;
  for (std::uint32_t i = begin; i < std::min(end, last); ++i) {
    look_around(records[i], true);
    partners.collect(records, around, records[i], i + 1, last);
    Contact sum = sums[i];
    for (const std::uint32_t j : partners.places()) {
      const Float3 force = pair_force(world.pair, records[i], records[j]);
      sum.force = sum.force + force;
      sum.touching = true;
      if (j >= end) continue;
      sums[j].force = sums[j].force - force;
      sums[j].touching = true;
    }
    sums[i] = sum;
  }
}

}  // namespace tandem::engine
