#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

EngineWorld fountain() {
  EngineWorld world = empty_world(40);
  world.emitters = {{{-1, 9, -1}, {1, 10, 1}, {0, -30, 0}, 45, 0}};
  world.regions = {{{-50, -50, -50}, {50, 0, 50}, Region::Action::kRemove, {}, 0}};
  return world;
}

TEST(Lifecycle, EventsTellExactlyHowTheAliveBitsChange) {
  const auto s = make(fountain());
  std::vector<std::uint8_t> alive(s->capacity(), 0);
  std::size_t spawned = 0;
  std::size_t despawned = 0;
  for (int frame = 0; frame < 200; ++frame) {
    s->step();
    const Event* previous = nullptr;
    for (const Event& event : s->events()) {
      if (previous != nullptr) {
        EXPECT_TRUE(previous->slot < event.slot ||
                    (previous->slot == event.slot && previous->kind == Event::Kind::kDespawned &&
                     event.kind == Event::Kind::kSpawned));
      }
      const bool spawn = event.kind == Event::Kind::kSpawned;
      EXPECT_EQ(alive[event.slot], spawn ? 0 : 1) << "frame " << frame;
      alive[event.slot] = spawn ? 1 : 0;
      ++(spawn ? spawned : despawned);
      previous = &event;
    }
    for (std::uint32_t slot = 0; slot < s->capacity(); ++slot)
      ASSERT_EQ(s->bodies().alive[slot], alive[slot]);
  }
  EXPECT_EQ(spawned, 300U);  // 45 a second
  EXPECT_GT(despawned, 200U);
}

TEST(Lifecycle, AFullHouseLeavesNewBodiesOut) {
  EngineWorld world = fountain();
  world.capacity = 3;
  world.regions.clear();
  const auto s = make(world);
  for (int frame = 0; frame < 5; ++frame) s->step();
  EXPECT_EQ(std::count(s->bodies().alive.begin(), s->bodies().alive.end(), 1), 3);
}

TEST(Lifecycle, ABodyThatLeavesTheBoundsIsRemoved) {
  EngineWorld world = empty_world(2);
  world.start = {{{99, 0, 0}, {60, 0, 0}, 0}, {{0, 0, 0}, {}, 0}};
  const auto s = make(world);
  s->step();
  ASSERT_EQ(s->events().size(), 1U);
  EXPECT_EQ(s->events()[0].kind, Event::Kind::kDespawned);
  EXPECT_EQ(s->events()[0].slot, 0U);
  EXPECT_EQ(s->bodies().alive[0], 0);
  EXPECT_EQ(s->bodies().alive[1], 1);
}

TEST(Lifecycle, RegionsTeleportAndChangeTypes) {
  EngineWorld world = empty_world(2);
  world.types = {{0.5F, 1}, {0.25F, 1}};
  world.start = {{{5, 0, 0}, {}, 0}, {{-5, 0, 0}, {}, 0}};
  world.regions = {{{4, -1, -1}, {6, 1, 1}, Region::Action::kTeleport, {0, 20, 0}, 0},
                   {{-6, -1, -1}, {-4, 1, 1}, Region::Action::kSetType, {}, 1}};
  const auto s = make(world);
  s->step();
  ASSERT_EQ(s->events().size(), 2U);
  EXPECT_EQ(s->events()[0].kind, Event::Kind::kTeleported);
  EXPECT_EQ(position(*s, 0)[1], 20);
  EXPECT_EQ(s->events()[1].kind, Event::Kind::kTypeChanged);
  EXPECT_EQ(s->bodies().type[1], 1);
  s->step();
  EXPECT_TRUE(s->events().empty());
}

}  // namespace
}  // namespace tandem::engine
