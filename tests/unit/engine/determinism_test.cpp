#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

EngineWorld busy_world() {
  EngineWorld world = pile_world(1500, 5);
  world.types = {{0.5F, 1}, {0.35F, 0.4F}};
  for (std::size_t i = 0; i < world.start.size(); i += 3) world.start[i].type = 1;
  world.boxes = {{{1, 2, 0}, {1, 1, 2}, {{{1, 0, 0}, {0, 0.8F, 0.6F}, {0, -0.6F, 0.8F}}}}};
  world.balls = {{{-3, 0, 0}, 2}};
  world.capacity = 1700;
  world.emitters = {{{-1, 20, -1}, {1, 22, 1}, {0, -3, 0}, 60, 1}};
  world.regions = {{{-5, -1, -5}, {-4, 1, -4}, Region::Action::kRemove, {}, 0}};
  return world;
}

void disturb(Simulation& s, int frame) {
  if (frame % 40 == 20) s.apply(gravity_input(frame % 80 == 20 ? 2 : -2, -2, 0.5));
  if (frame % 25 == 10) s.apply(push_input({0, 2, 0}, 3, {0, 4, 1}));
}

TEST(Determinism, TheNumberOfThreadsChangesNoBit) {
  const auto reference = make(busy_world(), 1);
  std::vector<std::unique_ptr<Simulation>> others;
  for (std::uint32_t threads = 2; threads <= 4; ++threads) others.push_back(make(busy_world(), threads));
  for (int frame = 1; frame <= 150; ++frame) {
    disturb(*reference, frame);
    reference->step();
    for (const auto& s : others) {
      disturb(*s, frame);
      s->step();
      ASSERT_TRUE(same_bodies(*reference, *s)) << "frame " << frame;
      ASSERT_EQ(reference->colliding(), s->colliding());
    }
  }
}

std::uint64_t hash_of(const Simulation& s) {
  std::uint64_t hash = 0xCBF29CE484222325U;  // FNV-1a over the bits of the living bodies
  const auto add = [&hash](float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x100000001B3U;
  };
  for (std::uint32_t slot = 0; slot < s.capacity(); ++slot) {
    if (s.bodies().alive[slot] == 0) continue;
    for (const auto& column : s.bodies().position) add(column[slot]);
    for (const auto& column : s.bodies().velocity) add(column[slot]);
  }
  return hash;
}

// One value for every compiler, optimisation level and instruction set. It changes with the order in which
// forces are added, and then only on purpose.
TEST(Determinism, ATrajectoryIsTheSameInEveryBuild) {
  const auto s = make(busy_world());
  for (int frame = 1; frame <= 200; ++frame) {
    disturb(*s, frame);
    s->step();
  }
  EXPECT_EQ(hash_of(*s), 8287194371551849651U);
}

TEST(Determinism, ASecondRunChangesNoBit) {
  const auto a = make(busy_world());
  const auto b = make(busy_world());
  for (int frame = 1; frame <= 100; ++frame) {
    disturb(*a, frame);
    disturb(*b, frame);
    a->step();
    b->step();
  }
  EXPECT_TRUE(same_bodies(*a, *b));
}

TEST(Checkpoint, ContinuesBitForBitWithAnInputStillWaiting) {
  const auto s = make(busy_world());
  for (int frame = 1; frame <= 60; ++frame) {
    disturb(*s, frame);
    s->step();
  }
  s->apply(push_input({0, 1, 0}, 4, {1, 2, 3}));
  std::vector<std::byte> bytes;
  s->save(bytes);
  const auto t = make(busy_world(), 2);
  ASSERT_TRUE(t->load(bytes));
  EXPECT_EQ(t->colliding(), s->colliding());
  for (int frame = 61; frame <= 120; ++frame) {
    disturb(*s, frame);
    disturb(*t, frame);
    s->step();
    t->step();
    ASSERT_TRUE(same_bodies(*s, *t)) << "frame " << frame;
    ASSERT_EQ(s->events().size(), t->events().size());
  }
}

TEST(Checkpoint, DamagedBytesAreRefusedAndChangeNothing) {
  const auto s = make(busy_world());
  for (int frame = 0; frame < 10; ++frame) s->step();
  std::vector<std::byte> bytes;
  s->save(bytes);
  const auto t = make(busy_world());
  const auto untouched = make(busy_world());
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 50; ++i) {
    std::vector<std::byte> damaged = bytes;
    damaged[random() % damaged.size()] ^= std::byte{1} << static_cast<int>(random() % 8);
    EXPECT_FALSE(t->load(damaged));
    damaged = bytes;
    damaged.resize(random() % damaged.size());
    EXPECT_FALSE(t->load(damaged));
  }
  EXPECT_FALSE(t->load({}));
  EXPECT_TRUE(same_bodies(*t, *untouched));
}

TEST(Checkpoint, OfAnotherWorldIsRefused) {
  const auto s = make(busy_world());
  std::vector<std::byte> bytes;
  s->save(bytes);
  EngineWorld other = busy_world();
  other.pair.spring += 1;
  EXPECT_FALSE(make(other)->load(bytes));
}

}  // namespace
}  // namespace tandem::engine
