#include "services/engines/scenes/scene.hpp"
#include "services/program/budget.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "services/engines/bullet/bullet.hpp"
#include "tests/unit/scenes/temporary.hpp"

namespace tandem::scenes {
namespace {

using ::testing::HasSubstr;

class EveryScene : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryScene, LoadsAndKeepsItsBodiesInPlayUnderItsScript) {
  const auto scene = load_scene(GetParam());
  ASSERT_TRUE(scene) << scene.error().message;
  auto made = make_simulation(*scene, 600, 7, 1);
  ASSERT_TRUE(made) << made.error().message;
  engine::Simulation& simulation = **made;
  const auto inputs = scripted_inputs(*scene, 7, 0, 300);
  EXPECT_FALSE(inputs.empty());
  std::size_t next = 0;
  std::size_t collisions = 0;
  for (std::uint64_t frame = 1; frame <= 300; ++frame) {
    for (; next < inputs.size() && inputs[next].frame == frame; ++next) {
      ASSERT_NE(simulation.classify(inputs[next].input).effect, engine::Classification::Effect::kRefused);
      simulation.apply(inputs[next].input);
    }
    simulation.step();
    collisions += simulation.colliding();
    ASSERT_TRUE(!scene->start || simulation.events().empty()) << "a body left in frame " << frame;
  }
  EXPECT_GT(collisions, 0U);
  for (std::uint32_t slot = 0; slot < 600; ++slot) {
    if (simulation.bodies().alive[slot] == 0) continue;
    for (const auto& column : simulation.bodies().position)
      EXPECT_LE(std::fabs(column[slot]), scene->extent_m);
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, EveryScene,
                         ::testing::Values("half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3",
                                           "emitter", "field", "hopper", "landslide"),
                         [](const auto& test) { return test.param; });

class PaperScene : public ::testing::TestWithParam<std::string> {};

// Positions, not velocities: with sub-steps a resting body's velocity makes up for the gravity of the coming
// step.
TEST_P(PaperScene, LeftAloneItsPileComesToRest) {
  constexpr std::uint32_t kBodies = 1000;
  const auto scene = load_scene(GetParam());
  ASSERT_TRUE(scene) << scene.error().message;
  auto made = make_simulation(*scene, kBodies, 7, 1);
  ASSERT_TRUE(made) << made.error().message;
  engine::Simulation& simulation = **made;
  for (int frame = 0; frame < 2000; ++frame) simulation.step();
  std::array<std::vector<float>, 3> before;
  for (std::size_t i = 0; i < 3; ++i) {
    before[i].assign(simulation.bodies().position[i].begin(), simulation.bodies().position[i].end());
  }
  for (int frame = 0; frame < 30; ++frame) simulation.step();
  std::vector<double> moved(kBodies);
  for (std::uint32_t slot = 0; slot < kBodies; ++slot) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto d = static_cast<double>(simulation.bodies().position[i][slot] - before[i][slot]);
      moved[slot] += d * d;
    }
    moved[slot] = std::sqrt(moved[slot]);
  }
  std::sort(moved.begin(), moved.end());
  EXPECT_LT(moved[kBodies / 2], 0.05 * scene->smallest_radius_m) << "way of half of them in one second";
  EXPECT_LT(moved[kBodies * 9 / 10], 0.15 * scene->smallest_radius_m) << "way of nine in ten";
  EXPECT_GE(simulation.colliding(), kBodies * 99 / 100);
}

INSTANTIATE_TEST_SUITE_P(Shipped, PaperScene,
                         ::testing::Values("half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3"),
                         [](const auto& test) { return test.param; });

TEST(Emitter, KeepsTwoThousandSlotsInMotionWithEveryKindOfEvent) {
  const auto scene = load_scene("emitter");
  ASSERT_TRUE(scene) << scene.error().message;
  auto made = make_simulation(*scene, 2000, 7, 1);
  ASSERT_TRUE(made) << made.error().message;
  engine::Simulation& simulation = **made;
  const auto inputs = scripted_inputs(*scene, 7, 0, 900);
  std::array<std::size_t, 4> events{};
  std::size_t next = 0;
  for (std::uint64_t frame = 1; frame <= 900; ++frame) {
    for (; next < inputs.size() && inputs[next].frame == frame; ++next) simulation.apply(inputs[next].input);
    simulation.step();
    for (const engine::Event& event : simulation.events()) ++events.at(static_cast<std::size_t>(event.kind));
  }
  const auto count = [&events](engine::Event::Kind kind) {
    return events.at(static_cast<std::size_t>(kind));
  };
  EXPECT_GT(count(engine::Event::Kind::kSpawned), 5000U);
  EXPECT_GT(count(engine::Event::Kind::kDespawned), 3500U);
  EXPECT_GT(count(engine::Event::Kind::kTeleported), 100U);
  EXPECT_GT(count(engine::Event::Kind::kTypeChanged), 3500U);
}

TEST(Scenes, ThePapersFiveAreThereWithTheirNumbersAndUsers) {
  const std::vector<std::string> names{"half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3"};
  const std::vector<std::uint32_t> users{1, 1, 1, 2, 3};
  EXPECT_THAT(scene_names(), ::testing::IsSupersetOf(names));
  for (std::uint32_t i = 0; i < 5; ++i) {
    const auto scene = load_scene(names[i]);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->number, i + 1);
    EXPECT_EQ(scene->users, users[i]);
    EXPECT_DOUBLE_EQ(scene->dt_s, 1.0 / 30);
    EXPECT_EQ(scene->name, names[i]);
    EXPECT_THAT(scene->text, HasSubstr("planes"));
    EXPECT_THAT(scene->text, ::testing::Not(HasSubstr("tilting")));
  }
}

TEST(Scenes, HoldTheNumbersOfBodiesOfThePaper) {
  for (const char* name : {"half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3"}) {
    const auto scene = load_scene(name);
    ASSERT_TRUE(scene);
    for (const std::uint32_t bodies : {1U, 5000U, 10000U, 20000U}) {
      const auto made = make_simulation(*scene, bodies, 1, 1);
      ASSERT_TRUE(made) << made.error().message;
      EXPECT_EQ((*made)->capacity(), bodies);
    }
  }
}

TEST(Scenes, AnUnknownNameListsTheKnownOnes) {
  const auto scene = load_scene("quarter_pipe");
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(scene.error().message, HasSubstr("quarter_pipe"));
  EXPECT_THAT(
      scene.error().message,
      HasSubstr(
          "asteroids, cube, dominoes, emitter, field, four_cubes, half_pipe, half_pipe_2, half_pipe_3, hopper, "
          "landslide, mixed, rubble, towers"));
}

TEST(Scenes, NoBodiesOrTooManyAreRefused) {
  const auto scene = load_scene("cube");
  ASSERT_TRUE(scene);
  for (const std::uint32_t bodies : {0U, (1U << 22U) + 1, UINT32_MAX}) {
    const auto made = make_simulation(*scene, bodies, 1, 1);
    ASSERT_FALSE(made);
    EXPECT_THAT(made.error().message, HasSubstr("1 to 4194304"));
  }
}

TEST(Scenes, MoreBodiesThanTheBoundsHoldAreRefused) {
  const TemporaryFolder folder;
  const auto scene = load_scene(folder.write("small.textproto", small_scene()));
  ASSERT_TRUE(scene) << scene.error().message;
  const auto made = make_simulation(*scene, 1000000, 1, 1);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("outside the bounds"));
}

TEST(Scenes, TheFillGrowsWithTheNumberOfBodiesAndRepeatsForASeed) {
  const auto scene = load_scene("half_pipe");
  ASSERT_TRUE(scene);
  const auto a = make_world(*scene, 2000, 5);
  const auto b = make_world(*scene, 2000, 5);
  const auto other = make_world(*scene, 2000, 6);
  const auto larger = make_world(*scene, 16000, 5);
  ASSERT_TRUE(a && b && other && larger);
  ASSERT_EQ(a->start.size(), 2000U);
  const auto height = [](const engine::EngineWorld& world) {
    float low = 1e9F;
    float high = -1e9F;
    for (const auto& body : world.start) {
      low = std::min(low, body.position[1]);
      high = std::max(high, body.position[1]);
    }
    return high - low;
  };
  bool differs = false;
  for (std::size_t i = 0; i < 2000; ++i) {
    EXPECT_EQ(a->start[i].position, b->start[i].position);
    differs = differs || a->start[i].position != other->start[i].position;
  }
  EXPECT_TRUE(differs);
  EXPECT_NEAR(height(*larger) / height(*a), 2, 0.3);
  EXPECT_EQ(larger->pair.spring, a->pair.spring);
}

// The distance of a body's surface from a plane.
float gap(const engine::Plane& plane, const engine::StartBody& body, float radius) {
  float height = -plane.offset - radius;
  for (std::size_t i = 0; i < 3; ++i) height += plane.normal[i] * body.position[i];
  return height;
}

TEST(Scenes, WallsAroundTheStartBlockGrowWithIt) {
  const auto scene = load_scene("field");
  ASSERT_TRUE(scene);
  for (const std::uint32_t bodies : {2'000U, 20'000U}) {
    const auto world = make_world(*scene, bodies, 3);
    ASSERT_TRUE(world);
    ASSERT_EQ(world->planes.size(), scene->world.planes.size() + 4);
    for (std::size_t i = scene->world.planes.size(); i < world->planes.size(); ++i) {
      float nearest = 1e9F;
      for (const engine::StartBody& body : world->start)
        nearest = std::min(nearest, gap(world->planes[i], body, 0.5F));
      EXPECT_GE(nearest, 0);
      EXPECT_LT(nearest, 0.05F);
    }
  }
}

TEST(Scenes, AStartBlockHasNoWallsUnlessItSaysSo) {
  const auto scene = load_scene("half_pipe");
  ASSERT_TRUE(scene);
  EXPECT_TRUE(walls_of(*scene, 1000).empty());
}

TEST(Scenes, NoTwoBodiesOfABlockTouchAtTheStart) {
  const auto scene = load_scene("four_cubes");
  ASSERT_TRUE(scene);
  const auto world = make_world(*scene, 500, 3);
  ASSERT_TRUE(world);
  for (std::size_t i = 0; i < 500; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      float squared = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const float d = world->start[i].position[k] - world->start[j].position[k];
        squared += d * d;
      }
      ASSERT_GE(squared, 1.0F);
    }
  }
}

class RigidScene : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (!engine::bullet_is_built()) GTEST_SKIP() << "no libbullet-dev";
  }
};

TEST_P(RigidScene, StaysWholeUnderItsScriptAndTurns) {
  const auto scene = load_scene(GetParam());
  ASSERT_TRUE(scene) << scene.error().message;
  constexpr std::uint32_t kBodies = 300;
  auto made = make_simulation(*scene, kBodies, 7, 1);
  ASSERT_TRUE(made) << made.error().message;
  engine::Simulation& simulation = **made;
  const auto inputs = scripted_inputs(*scene, 7, 0, 360);
  EXPECT_FALSE(inputs.empty());
  std::size_t next = 0;
  for (std::uint64_t frame = 1; frame <= 360; ++frame) {
    for (; next < inputs.size() && inputs[next].frame == frame; ++next) {
      const auto classified = simulation.classify(inputs[next].input);
      ASSERT_NE(classified.effect, engine::Classification::Effect::kRefused) << classified.reason;
      simulation.apply(inputs[next].input);
    }
    simulation.step();
    const engine::Bodies bodies = simulation.bodies();
    for (std::uint32_t slot = 0; slot < kBodies; ++slot) {
      if (bodies.alive[slot] == 0) continue;
      float norm = 0;
      for (const auto& column : bodies.orientation) norm += column[slot] * column[slot];
      ASSERT_NEAR(norm, 1, 1e-3);
    }
  }
  EXPECT_EQ(simulation.mishaps(), engine::Mishaps{});
  EXPECT_GT(simulation.colliding(), kBodies / 2);
}

/// Bodies that are left of `rubble` after a participant tried to push all of them up as hard as the scene
/// permits, 60 times a second; and how many pushes it had.
std::pair<std::uint32_t, int> left_of_rubble(bool limited, int tries) {
  constexpr std::uint32_t kBodies = 300;
  auto simulation = *make_simulation(*load_scene("rubble"), kBodies, 7, 1);
  const engine::InputBudget limit = simulation->input_budget();
  EXPECT_EQ(limit.per_second, 3.75);
  EXPECT_EQ(limit.most, 30);
  accounts::Budget budget;
  const engine::Input push{.kind = 2, .values = {0, 0, 0, 1000, 0, 30, 0}};
  int taken = 0;
  std::int64_t now_ns = 0;
  const auto step = [&] {
    simulation->step();
    now_ns += 1'000'000'000 / 60;
  };
  for (int i = 0; i < 120; ++i) step();
  for (int i = 0; i < tries; ++i, step()) {
    const auto classified = simulation->classify(push);
    EXPECT_EQ(classified.effect, engine::Classification::Effect::kImmediate);
    if (limited && !budget.take(classified.cost, {limit.per_second, limit.most}, now_ns)) continue;
    simulation->apply(push);
    ++taken;
  }
  for (int i = 0; i < 600; ++i) step();
  const auto alive = simulation->bodies().alive;
  return {static_cast<std::uint32_t>(std::count(alive.begin(), alive.end(), std::uint8_t{1})), taken};
}

TEST(RubbleScene, OneParticipantCannotPushItEmpty) {
  if (!engine::bullet_is_built()) GTEST_SKIP();
  EXPECT_EQ(left_of_rubble(false, 400).first, 0U) << "as it would be without a budget";
  const auto [left, pushes] = left_of_rubble(true, 900);
  EXPECT_EQ(left, 300U);
  EXPECT_EQ(pushes, 1 + 15 / 8);
}

// Bullet's heaps of boxes tremble: now and then one of them is kicked, which keeps all that touch awake.
TEST_P(RigidScene, LeftAloneComesToRest) {
  const auto scene = load_scene(GetParam());
  ASSERT_TRUE(scene) << scene.error().message;
  auto made = make_simulation(*scene, 200, 7, 1);
  ASSERT_TRUE(made) << made.error().message;
  engine::Simulation& simulation = **made;
  for (int frame = 0; frame < 900; ++frame) simulation.step();
  const engine::Bodies bodies = simulation.bodies();
  const float least = GetParam() == "rubble" ? 0.1F : 0;  // m/s
  std::uint32_t still = 0;
  std::uint32_t alive = 0;
  for (std::uint32_t slot = 0; slot < 200; ++slot) {
    alive += bodies.alive[slot];
    if (bodies.alive[slot] != 0 && std::fabs(bodies.velocity[1][slot]) <= least) ++still;
  }
  EXPECT_GE(still, alive * 95 / 100);
}

INSTANTIATE_TEST_SUITE_P(Shipped, RigidScene, ::testing::Values("towers", "rubble", "dominoes", "mixed"),
                         [](const auto& test) { return test.param; });

TEST(Scenes, TowersAndDominoesStandUntilSomebodyPushes) {
  if (!engine::bullet_is_built()) GTEST_SKIP() << "no libbullet-dev";
  for (const char* name : {"towers", "dominoes"}) {
    const auto scene = load_scene(name);
    ASSERT_TRUE(scene) << scene.error().message;
    auto made = make_simulation(*scene, 200, 7, 1);
    ASSERT_TRUE(made) << made.error().message;
    const engine::Bodies bodies = (*made)->bodies();
    const std::vector<float> before(bodies.position[1].begin(), bodies.position[1].end());
    for (int frame = 0; frame < 600; ++frame) (*made)->step();
    for (std::uint32_t slot = 0; slot < 200; ++slot) {
      if (bodies.alive[slot] == 0) continue;
      ASSERT_NEAR(bodies.position[1][slot], before[slot], 0.05) << name;
    }
  }
}

TEST(Scenes, RigidBodiesStartAsTheSceneSays) {
  const auto towers = load_scene("towers");
  ASSERT_TRUE(towers) << towers.error().message;
  EXPECT_EQ(towers->engine, EngineKind::kBullet);
  EXPECT_FLOAT_EQ(towers->friction, 0.6F);
  const auto world = make_rigid_world(*towers, 1000, 3);
  ASSERT_TRUE(world) << world.error().message;
  EXPECT_EQ(world->world.capacity, 1000U);
  EXPECT_EQ(world->world.start.size(), 980U) << "two of a hundred slots are spare";
  ASSERT_EQ(world->orientation.size(), 980U);
  EXPECT_EQ(world->orientation[0][3], 1);
  EXPECT_NE(world->orientation[3][3], 1) << "the second layer lies crosswise";
  EXPECT_NE(world->world.start[0].position, make_rigid_world(*towers, 1000, 4)->world.start[0].position);
  EXPECT_EQ(world->world.start[0].position, make_rigid_world(*towers, 1000, 3)->world.start[0].position);
  const auto mixed = load_scene("mixed");
  ASSERT_TRUE(mixed) << mixed.error().message;
  EXPECT_NEAR(mixed->smallest_radius_m, 0.12, 1e-6) << "half of the slab's height";
  EXPECT_EQ(mixed->types[4].shape.kind, engine::Shape::Kind::kCapsule);
  EXPECT_NEAR(mixed->types[4].bounding_radius_m, 0.43, 1e-6);
  EXPECT_EQ(make_rigid_world(*mixed, 100, 1)->orientation.size(), 99U);
}

TEST(Scenes, WithoutBulletItSaysSoInOneLine) {
  if (engine::bullet_is_built()) GTEST_SKIP() << "it is there";
  const auto scene = load_scene("towers");
  ASSERT_TRUE(scene) << scene.error().message;
  const auto made = make_simulation(*scene, 100, 1, 1);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("libbullet-dev"));
}

TEST(Scenes, APathOrAnotherFolderIsReadInsteadOfTheShippedOnes) {
  const TemporaryFolder folder;
  const std::string path = folder.write("mine.textproto", small_scene());
  EXPECT_TRUE(load_scene(path));
  EXPECT_FALSE(load_scene("mine"));
  ASSERT_EQ(setenv("TANDEM_SCENE_DIR", folder.path().c_str(), 1), 0);
  EXPECT_TRUE(load_scene("mine"));
  EXPECT_THAT(scene_names(), ::testing::ElementsAre("mine"));
  EXPECT_FALSE(load_scene("cube"));
  unsetenv("TANDEM_SCENE_DIR");
}

TEST(Scenes, BoxesTurnByTheirTangent) {
  const TemporaryFolder folder;
  const auto scene = load_scene(
      folder.write("turned.textproto", small_scene("boxes { size { x: 2 y: 4 z: 6 } turns { axis: \"z\" "
                                                   "rise: 3 run: 4 } turns { axis: \"y\" rise: 1 } }")));
  ASSERT_TRUE(scene) << scene.error().message;
  const engine::Box& box = scene->world.boxes.at(0);
  EXPECT_EQ(box.half, (engine::Vec3f{1, 2, 3}));
  EXPECT_EQ(box.axes[0], (engine::Vec3f{0, 0.6F, -0.8F}));  // x: (0.8, 0.6, 0), then x goes to -z
  EXPECT_EQ(box.axes[1], (engine::Vec3f{0, 0.8F, 0.6F}));
  EXPECT_EQ(box.axes[2], (engine::Vec3f{1, 0, 0}));
}

}  // namespace
}  // namespace tandem::scenes
