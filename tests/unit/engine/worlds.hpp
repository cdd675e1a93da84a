#pragma once
// Small worlds and ways to look at them, shared by the engine's tests.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <random>

#include "services/engines/particles/particles.hpp"

namespace tandem::engine {

inline constexpr std::uint64_t kSeed = 20240229;

/// No gravity, no geometry, one type of radius 0.5 and mass 1, no bodies.
inline EngineWorld empty_world(std::uint32_t capacity) {
  EngineWorld world;
  world.capacity = capacity;
  world.seed = kSeed;
  world.gravity = {0, 0, 0};
  world.types = {{0.5F, 1}};
  return world;
}

inline std::unique_ptr<Simulation> make(const EngineWorld& world, std::uint32_t threads = 1,
                                        Instructions instructions = Instructions::kBest) {
  auto made = make_particles(world, threads, instructions);
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

inline Vec3 position(const Simulation& s, std::uint32_t slot) {
  const Bodies b = s.bodies();
  return {static_cast<double>(b.position[0][slot]), static_cast<double>(b.position[1][slot]),
          static_cast<double>(b.position[2][slot])};
}

inline Vec3 velocity(const Simulation& s, std::uint32_t slot) {
  const Bodies b = s.bodies();
  return {static_cast<double>(b.velocity[0][slot]), static_cast<double>(b.velocity[1][slot]),
          static_cast<double>(b.velocity[2][slot])};
}

inline Input gravity_input(double x, double y, double z) {
  return {static_cast<std::uint32_t>(InputKind::kGravity), {x, y, z}, {}};
}

inline Input push_input(const Vec3& centre, double radius, const Vec3& change) {
  return {static_cast<std::uint32_t>(InputKind::kPush),
          {centre[0], centre[1], centre[2], radius, change[0], change[1], change[2]},
          {}};
}

/// An open box on the floor y = 0, `half` wide to each side, with `bodies` stacked in it a little apart.
inline EngineWorld pile_world(std::uint32_t bodies, float half) {
  EngineWorld world = empty_world(bodies);
  world.gravity = {0, -3, 0};
  world.pair = {200, 1.5F, 1.5F};
  world.wall = {200, 1.5F, 1.5F};
  world.low = {-half - 5, -5, -half - 5};
  world.high = {half + 5, 200, half + 5};
  world.planes = {
      {{0, 1, 0}, 0}, {{1, 0, 0}, -half}, {{-1, 0, 0}, -half}, {{0, 0, 1}, -half}, {{0, 0, -1}, -half}};
  std::mt19937_64 random(kSeed);
  const auto jitter = [&random] { return 0.05F * static_cast<float>(random() >> 40U) * 0x1p-24F; };
  const auto across = static_cast<std::uint32_t>(2 * half / 1.1F);
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const auto x = static_cast<float>(i % across);
    const auto z = static_cast<float>(i / across % across);
    const auto y = static_cast<float>(i / (across * across));
    world.start.push_back(
        {{1.1F * x - half + 0.6F + jitter(), 1.1F * y + 0.6F + jitter(), 1.1F * z - half + 0.6F + jitter()},
         {},
         0});
  }
  return world;
}

/// Bit-exact comparison of two simulations' bodies; names the first slot that differs.
inline ::testing::AssertionResult same_bodies(const Simulation& a, const Simulation& b) {
  const Bodies x = a.bodies();
  const Bodies y = b.bodies();
  for (std::uint32_t slot = 0; slot < a.capacity(); ++slot) {
    bool same = x.alive[slot] == y.alive[slot] && x.type[slot] == y.type[slot];
    for (std::size_t i = 0; i < 3 && same && x.alive[slot] != 0; ++i) {
      same = std::memcmp(&x.position[i][slot], &y.position[i][slot], sizeof(float)) == 0 &&
             std::memcmp(&x.velocity[i][slot], &y.velocity[i][slot], sizeof(float)) == 0;
    }
    if (!same) return ::testing::AssertionFailure() << "slot " << slot << " differs";
  }
  return ::testing::AssertionSuccess();
}

/// Root mean square over all slots; of living bodies only where all live.
inline double rms_speed(const Simulation& s) {
  double sum = 0;
  for (std::uint32_t slot = 0; slot < s.capacity(); ++slot) {
    const Vec3 v = velocity(s, slot);
    sum += v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  }
  return std::sqrt(sum / s.capacity());
}

}  // namespace tandem::engine
