// Bodies that cruise in a ball: Cruising in idl/scene.proto.
#include <algorithm>
#include <cmath>

#include "sdk/core/lattice/assert.hpp"
#include "services/engines/scenes/random.hpp"
#include "services/engines/scenes/start_block.hpp"

namespace tandem::scenes {
namespace {

using engine::Vec3;
using engine::Vec3f;

constexpr std::uint64_t kSpeedKey = 0x5350454544;  // streams of random numbers of their own
constexpr std::uint64_t kBallKey = 0x42414C4C;
constexpr double kBodiesOfRadius = 1000;  // the number of bodies for which the scene states the ball's radius

// By Newton's iteration, as cbrt() differs between mathematics libraries.
double cube_root(double x) {
  double root = std::max(x, 1.0);
  for (int i = 0; i < 64; ++i) root -= (root - x / (root * root)) / 3;
  return root;
}

Vec3f scaled(const Vec3& v, double by) {
  return {static_cast<float>(v[0] * by), static_cast<float>(v[1] * by), static_cast<float>(v[2] * by)};
}

double distance_squared(const Vec3& a, const Vec3f& b) {
  double squared = 0;
  for (std::size_t i = 0; i < 3; ++i) squared += (a[i] - double{b[i]}) * (a[i] - double{b[i]});
  return squared;
}

// Uniform over all directions.
Vec3 direction(Random& random) {
  for (;;) {
    const Vec3 in_ball = random.in_ball();
    if (const Vec3 along = normalised(in_ball, {}); along != Vec3{}) return along;
  }
}

// Whether a body at `place` keeps twice its radius from the surfaces of all others and of the scene's
// spheres.
bool is_free(const Scene& scene, const std::vector<engine::StartBody>& others, const Vec3& place,
             double radius) {
  const auto apart = [&](const Vec3f& from, double other) {
    const double gap = 2 * radius + other;
    return distance_squared(place, from) > gap * gap;
  };
  return std::ranges::all_of(
             scene.world.balls,
             [&](const engine::Ball& ball) { return apart(ball.centre, double{ball.radius}); }) &&
         std::ranges::all_of(others, [&](const engine::StartBody& other) {
           return apart(other.position, scene.types[other.type].bounding_radius_m);
         });
}

}  // namespace

engine::Cruise cruise_of(const Scene& scene, std::uint32_t bodies, std::uint64_t seed) {
  TANDEM_ASSERT(scene.cruising);
  const Cruising& cruising = *scene.cruising;
  const double of_stated = cube_root(static_cast<double>(bodies) / kBodiesOfRadius);
  engine::Cruise cruise;
  cruise.radius = static_cast<float>(cruising.radius_m * of_stated);
  cruise.acceleration = static_cast<float>(cruising.acceleration);
  cruise.return_acceleration = static_cast<float>(cruising.return_acceleration);
  Random random(seed, kSpeedKey);
  for (std::uint32_t slot = 0; slot < bodies; ++slot) {
    const double share = random.unit();
    cruise.speed.push_back(
        static_cast<float>(cruising.min_speed + share * (cruising.max_speed - cruising.min_speed)));
  }
  return cruise;
}

RigidStart fill_ball(const Scene& scene, const engine::Cruise& cruise, std::uint32_t bodies,
                     std::uint64_t seed) {
  TANDEM_ASSERT(scene.cruising && bodies <= cruise.speed.size());
  Random random(seed, kBallKey);
  RigidStart start;
  start.orientation = turn_at_random(bodies, seed);
  for (std::uint32_t slot = 0; slot < bodies; ++slot) {
    engine::StartBody body;
    body.type = pick_type(scene.types, random.bits());
    const double radius = scene.types[body.type].bounding_radius_m;
    Vec3 place = random.in_ball();
    const Vec3 outwards = normalised(place, {1, 0, 0});
    for (double& v : place) v *= double{cruise.radius};
    // Where no room is, it is looked for further and further outwards, so that there always is some.
    for (double step = 2 * radius; !is_free(scene, start.bodies, place, radius); step *= 2)
      for (std::size_t i = 0; i < 3; ++i) place[i] += step * outwards[i];
    body.position = scaled(place, 1);
    body.velocity = scaled(direction(random), double{cruise.speed[slot]});
    start.bodies.push_back(body);
    start.spin.push_back(scaled(random.in_ball(), scene.cruising->max_spin));
  }
  return start;
}

}  // namespace tandem::scenes
