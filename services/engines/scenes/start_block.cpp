#include "services/engines/scenes/start_block.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/core/lattice/assert.hpp"
#include "services/engines/scenes/random.hpp"

namespace tandem::scenes {
namespace {

constexpr std::uint64_t kStartKey = 0x5354415254;  // "START": its own stream of random numbers

struct Footprint {
  std::uint64_t x = 1, z = 1;
};

// Bodies along x and z of a block of `bodies` with the given proportions: the largest whole multiple of 1/16
// of the proportions whose block is not yet large enough, plus one sixteenth.
Footprint footprint(const engine::Vec3& proportions, std::uint32_t bodies) {
  const double smallest = std::min({proportions[0], proportions[1], proportions[2]});
  Footprint best;
  for (double scale = 1 / smallest;; scale += 1 / (16 * smallest)) {
    const auto along = [&](std::size_t i) {
      return static_cast<std::uint64_t>(std::llround(proportions[i] * scale));
    };
    best = {std::max<std::uint64_t>(along(0), 1), std::max<std::uint64_t>(along(2), 1)};
    if (best.x * best.z * std::max<std::uint64_t>(along(1), 1) >= bodies) return best;
  }
}

double largest_diameter(const Scene& scene) {
  double diameter = 0;
  for (const BodyType& type : scene.types) diameter = std::max(diameter, 2 * type.bounding_radius_m);
  return diameter;
}

}  // namespace

std::uint16_t pick_type(const std::vector<BodyType>& types, std::uint64_t random) {
  std::uint64_t total = 0;
  for (const BodyType& type : types) total += type.share;
  if (total == 0) return 0;
  std::uint64_t at = random % total;
  std::uint16_t picked = 0;
  while (at >= types[picked].share) at -= types[picked++].share;
  return picked;
}

std::vector<engine::Plane> walls_around(const Scene& scene, std::uint32_t bodies) {
  TANDEM_ASSERT(scene.start);
  const StartBlock& block = *scene.start;
  const Footprint across = footprint(block.proportions, bodies);
  const double pitch = block.spacing * largest_diameter(scene);
  const double half_x = 0.5 * pitch * static_cast<double>(across.x);
  const double half_z = 0.5 * pitch * static_cast<double>(across.z);
  const auto offset = [](double at) { return static_cast<float>(at); };
  return {{{1, 0, 0}, offset(block.base[0] - half_x)},
          {{-1, 0, 0}, offset(-block.base[0] - half_x)},
          {{0, 0, 1}, offset(block.base[2] - half_z)},
          {{0, 0, -1}, offset(-block.base[2] - half_z)}};
}

std::vector<engine::StartBody> fill_block(const Scene& scene, std::uint32_t bodies, std::uint64_t seed) {
  TANDEM_ASSERT(scene.start);
  const StartBlock& block = *scene.start;
  const double diameter = largest_diameter(scene), pitch = block.spacing * diameter;
  const double reach = 0.5 * block.jitter * (pitch - diameter);
  const Footprint across = footprint(block.proportions, bodies);
  Random random(seed, kStartKey);
  std::vector<engine::StartBody> result;
  result.reserve(bodies);
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const std::uint64_t layer = i / (across.x * across.z);
    const std::array<double, 3> place{
        (static_cast<double>(i % across.x) - 0.5 * static_cast<double>(across.x - 1)) * pitch,
        (static_cast<double>(layer) + 0.5) * pitch,
        (static_cast<double>(i / across.x % across.z) - 0.5 * static_cast<double>(across.z - 1)) * pitch};
    engine::StartBody body;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      body.position[axis] = static_cast<float>(block.base[axis] + place[axis] + reach * random.both_sides());
      body.velocity[axis] = static_cast<float>(block.velocity[axis]);
    }
    body.type = pick_type(scene.types, random.bits());
    result.push_back(body);
  }
  return result;
}

}  // namespace tandem::scenes
