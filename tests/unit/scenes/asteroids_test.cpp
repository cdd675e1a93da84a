// The scene `asteroids`: bodies that cruise in a ball.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "services/engines/bullet/bullet.hpp"
#include "services/engines/scenes/scene.hpp"

namespace tandem::scenes {
namespace {

constexpr std::uint32_t kAsteroids = 250;
constexpr double kBall = 31.498;  // m; 50 for 1,000 bodies, by the cube root of their number
constexpr double kPlanetoid = 5;  // m
constexpr int kMinute = 60 * 30;  // frames

std::unique_ptr<engine::Simulation> asteroids(std::uint64_t seed = 7, std::uint32_t threads = 1) {
  return make_simulation(load_scene("asteroids").value(), kAsteroids, seed, threads).value();
}

void run(engine::Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) simulation.step();
}

double norm(const std::array<std::span<const float>, 3>& columns, std::uint32_t slot) {
  double squared = 0;
  for (const auto& column : columns) squared += double{column[slot]} * double{column[slot]};
  return std::sqrt(squared);
}

/// Everything that clients see of the bodies.
std::vector<float> values(const engine::Simulation& simulation) {
  const engine::Bodies bodies = simulation.bodies();
  std::vector<float> all;
  const auto add = [&all](const auto& columns) {
    for (const auto& column : columns) all.insert(all.end(), column.begin(), column.end());
  };
  add(bodies.position);
  add(bodies.velocity);
  add(bodies.orientation);
  add(bodies.angular_velocity);
  return all;
}

class Asteroids : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!engine::bullet_is_built()) GTEST_SKIP() << "no libbullet-dev";
  }
};

TEST_F(Asteroids, StartApartInTheirBallWithSpeedsAndSpinsOfTheirOwn) {
  const auto scene = load_scene("asteroids");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(scene->threshold_m, 0.01, 1e-8);
  const auto simulation = asteroids();
  const engine::Bodies bodies = simulation->bodies();
  std::array<int, 3> speeds{};
  for (std::uint32_t slot = 0; slot < kAsteroids; ++slot) {
    const double speed = norm(bodies.velocity, slot);
    EXPECT_GE(speed, 0.999);
    EXPECT_LE(speed, 4.001);
    ++speeds.at(std::min<std::size_t>(static_cast<std::size_t>(speed) - (speed < 1 ? 0U : 1U), 2));
    EXPECT_LE(norm(bodies.angular_velocity, slot), 0.7854);
    EXPECT_GT(norm(bodies.position, slot), kPlanetoid);
    EXPECT_LT(norm(bodies.position, slot), kBall + 5);
  }
  for (const int of_a_third : speeds) EXPECT_NEAR(of_a_third, kAsteroids / 3, 25);
  simulation->step();
  EXPECT_EQ(simulation->colliding(), 0U);
}

TEST_F(Asteroids, StayInTheirBallAndRegainTheirSpeedsWhateverTheyStrike) {
  const auto simulation = asteroids();
  const engine::Bodies bodies = simulation->bodies();
  std::uint64_t struck = 0;
  for (int frame = 0; frame < 2 * kMinute; ++frame) {
    simulation->step();
    struck += simulation->colliding();
    for (std::uint32_t slot = 0; slot < kAsteroids; ++slot) {
      ASSERT_LT(norm(bodies.position, slot), kBall + 5) << "frame " << frame;
      ASSERT_GT(norm(bodies.position, slot), kPlanetoid) << "frame " << frame;
    }
  }
  EXPECT_GT(struck, 100U);
  EXPECT_EQ(simulation->mishaps(), engine::Mishaps{});
  EXPECT_EQ(std::count(bodies.alive.begin(), bodies.alive.end(), 1), kAsteroids);
  std::uint32_t at_speed = 0;
  for (std::uint32_t slot = 0; slot < kAsteroids; ++slot) {
    const double speed = norm(bodies.velocity, slot);
    at_speed += speed > 0.99 && speed < 4.01 ? 1U : 0U;
  }
  EXPECT_GT(at_speed, kAsteroids * 9 / 10);
}

TEST_F(Asteroids, OfMoreThanTheBoundsHoldAreRefusedBeforePlacesAreSought) {
  const auto made = make_simulation(load_scene("asteroids").value(), 1'000'000, 1, 1);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, ::testing::HasSubstr("outside the bounds"));
}

TEST_F(Asteroids, ASeedRepeatsOnAnyNumberOfThreadsAndAnotherOneDiffers) {
  const auto one = asteroids(7, 1);
  const auto many = asteroids(7, 3);
  const auto other = asteroids(8, 1);
  EXPECT_NE(values(*one), values(*other));
  for (auto* each : {one.get(), many.get()}) run(*each, kMinute / 4);
  EXPECT_EQ(values(*one), values(*many));
}

TEST_F(Asteroids, ContinueFromACheckpointAndOnlyInTheirOwnWorld) {
  const auto before = asteroids();
  run(*before, kMinute / 4);
  std::vector<std::byte> saved;
  before->save(saved);
  const auto one = asteroids();
  const auto two = asteroids();
  ASSERT_TRUE(one->load(saved));
  ASSERT_TRUE(two->load(saved));
  EXPECT_EQ(values(*one), values(*before));
  for (auto* each : {one.get(), two.get()}) run(*each, kMinute / 4);
  EXPECT_EQ(values(*one), values(*two));
  EXPECT_FALSE(asteroids(8)->load(saved));
}

}  // namespace
}  // namespace tandem::scenes
