#include <algorithm>
#include <cmath>

#include "sdk/core/lattice/assert.hpp"
#include "services/engines/scenes/random.hpp"
#include "services/engines/scenes/start_block.hpp"

namespace tandem::scenes {
namespace {

using engine::Quaternion;
using engine::Vec3;

constexpr std::uint64_t kTowersKey = 0x544F574552;  // streams of random numbers of their own
constexpr std::uint64_t kRowsKey = 0x524F5753;
constexpr std::uint64_t kTurnKey = 0x5455524E;
constexpr std::uint32_t kAcross = 3;  // boxes in a row of a tower's layer
constexpr double kGap =
    0.02;  // gap between boxes, in widths of a box; touching boxes would push each other away
constexpr double kJitter = 0.01;          // maximum displacement of a body, in widths
constexpr float kHalfRoot = 0.70710677F;  // sqrt(1/2)

Vec3 edges(const BodyType& type) {
  const std::vector<float>& half = type.shape.values;
  return {2.0 * static_cast<double>(half[0]), 2.0 * static_cast<double>(half[1]),
          2.0 * static_cast<double>(half[2])};
}

engine::StartBody at(const Vec3& place, std::uint16_t type) {
  engine::StartBody body;
  for (std::size_t i = 0; i < 3; ++i) body.position[i] = static_cast<float>(place[i]);
  body.type = type;
  return body;
}

// The place of item `i` of `count` around the middle.
double centred(std::uint32_t i, std::uint32_t count, double pitch) {
  return (static_cast<double>(i) - 0.5 * (static_cast<double>(count) - 1)) * pitch;
}

}  // namespace

RigidStart fill_towers(const Scene& scene, std::uint32_t bodies, std::uint64_t seed) {
  TANDEM_ASSERT(scene.towers && scene.towers->layers > 0);
  const Towers& towers = *scene.towers;
  const Vec3 edge = edges(scene.types[towers.type]);
  const std::uint32_t of_a_tower = kAcross * towers.layers;
  const std::uint32_t count = (bodies + of_a_tower - 1) / of_a_tower;
  std::uint32_t side = 1;
  while (std::uint64_t{side} * side < count) ++side;
  Random random(seed, kTowersKey);
  RigidStart start;
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const std::uint32_t tower = i / of_a_tower;
    const std::uint32_t layer = i % of_a_tower / kAcross;
    const double aside = centred(i % kAcross, kAcross, edge[2] * (1 + kGap));
    const bool turned = layer % 2 == 1;
    Vec3 place{towers.base[0] + centred(tower % side, side, towers.pitch_m) + (turned ? aside : 0),
               towers.base[1] + (static_cast<double>(layer) + 0.5) * edge[1],
               towers.base[2] + centred(tower / side, side, towers.pitch_m) + (turned ? 0 : aside)};
    for (const std::size_t axis : {0U, 2U}) place[axis] += kJitter * edge[2] * random.both_sides();
    start.bodies.push_back(at(place, towers.type));
    start.orientation.push_back(turned ? Quaternion{0, kHalfRoot, 0, kHalfRoot} : Quaternion{0, 0, 0, 1});
  }
  return start;
}

RigidStart fill_rows(const Scene& scene, std::uint32_t bodies, std::uint64_t seed) {
  TANDEM_ASSERT(scene.rows && scene.rows->length > 0);
  const Rows& rows = *scene.rows;
  const Vec3 edge = edges(scene.types[rows.type]);
  const std::uint32_t count = (bodies + rows.length - 1) / rows.length;
  Random random(seed, kRowsKey);
  RigidStart start;
  for (std::uint32_t i = 0; i < bodies; ++i) {
    Vec3 place{rows.base[0] + rows.pitch_m * static_cast<double>(i % rows.length),
               rows.base[1] + 0.5 * edge[1],
               rows.base[2] + centred(i / rows.length, count, rows.row_pitch_m)};
    for (const std::size_t axis : {0U, 2U}) {
      place[axis] += kJitter * std::min(edge[0], edge[2]) * random.both_sides();
    }
    start.bodies.push_back(at(place, rows.type));
  }
  return start;
}

std::vector<Quaternion> turn_at_random(std::uint32_t bodies, std::uint64_t seed) {
  Random random(seed, kTurnKey);
  std::vector<Quaternion> turned;
  while (turned.size() < bodies) {
    // Uniform in the ball of four dimensions, by rejection; near its centre there is no direction.
    std::array<double, 4> q{};
    double squared = 0;
    for (double& v : q) {
      v = random.both_sides();
      squared += v * v;
    }
    if (squared > 1 || squared < 1e-6) continue;
    const double length = std::sqrt(squared);
    turned.push_back({static_cast<float>(q[0] / length), static_cast<float>(q[1] / length),
                      static_cast<float>(q[2] / length), static_cast<float>(q[3] / length)});
  }
  return turned;
}

}  // namespace tandem::scenes
