#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <numeric>
#include <thread>

#include "sdk/core/predict/contact/contact.hpp"
#include "tests/property/random.hpp"
#include "tests/property/slow_contact.hpp"

// With 100,000 bodies and more, the step gives the same bits on any number of threads, in any order of blocks
// and with any kernels: those of a slow step, body by body.

namespace tandem {
namespace {

using synthetic::Random;

constexpr std::uint32_t kBodies = 100'000;
constexpr std::int32_t kRadius = 20'000;
constexpr std::uint64_t kSeed = 81;

StepInput input_at(int frame) {
  return {{{frame % 2 == 0 ? 2000 : -2000, -3000, 500}, 200}, {.decay = 700}, kRadius / 10, {}};
}

ContactConstants constants_of_a_room(std::int32_t wall) {
  constexpr std::int32_t kOne = ContactConstants::kOne;
  ContactConstants constants;
  constants.pair = constants.wall = {3641, 410, 410};
  constants.types = {{kRadius, 65536}, {kRadius / 2, 131072}};
  constants.planes = {{{0, kOne, 0}, 0}, {{kOne, 0, 0}, -wall}, {{0, 0, -kOne}, -wall}};
  return constants;
}

/// `count` bodies in layers of `side` a side, in any order of slots, with some slots dead.
State heap(Random& random, std::uint32_t count, std::int32_t side) {
  State state(count);
  std::vector<Slot> slots(count);
  std::iota(slots.begin(), slots.end(), Slot{0});
  for (std::uint32_t k = count - 1; k > 0; --k) std::swap(slots[k], slots[random.below(k + 1)]);
  for (std::uint32_t k = 0; k < count; ++k) {
    if (random.one_in(50)) continue;
    const auto at = static_cast<std::int32_t>(k);
    const auto along = [&](std::int32_t number) { return number * (2 * kRadius) + random.even(kRadius / 2); };
    const Vec3i p{along(at % side - side / 2), along(at / (side * side)), along(at / side % side - side / 2)};
    const Vec3i v{random.even(300'000), random.even(300'000), random.even(300'000)};
    state.spawn(slots[k], 0, static_cast<TypeId>(random.one_in(5) ? 1 : 0), {p, v, {}, {}});
    for (std::size_t i = 0; i < 3; ++i) state.c(i)[slots[k]] = random.even(500);
  }
  return state;
}

/// Runs blocks on some threads, those of higher numbers first.
RunBlocks on_threads(std::uint32_t threads) {
  return [threads](std::uint32_t count, const std::function<void(std::uint32_t)>& job) {
    std::atomic<std::uint32_t> left = count;
    const auto work = [&] {
      for (std::uint32_t taken = left.fetch_sub(1); taken >= 1 && taken <= count; taken = left.fetch_sub(1))
        job(taken - 1);
    };
    std::vector<std::jthread> others;
    for (std::uint32_t i = 1; i < threads; ++i) others.emplace_back(work);
    work();
  };
}

void expect_the_same_bits(const State& start, const ContactConstants& constants, int frames = 3) {
  State expected = start;
  std::vector<State> after;
  SlowContact slow(start.capacity(), constants);
  for (int frame = 0; frame < frames; ++frame) {
    slow.step(expected, input_at(frame));
    after.push_back(expected);
  }
  for (const bool portable : {false, true}) {
    for (const std::uint32_t threads : {0U, 1U, 2U, 3U}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, " << (portable ? "portable" : "fastest"));
      Contact contact(start.capacity(), constants,
                      portable ? portable_contact_kernels() : fastest_contact_kernels());
      if (threads > 0) contact.spread_by(on_threads(threads));
      State state = start;
      State other(start.capacity());
      for (int frame = 0; frame < frames; ++frame) {
        // In place, as a server does, and from one state to another, as a client does.
        if (threads % 2 == 0) {
          contact.step(state, state, input_at(frame));
        } else {
          contact.step(state, other, input_at(frame));
          std::swap(state, other);
        }
        ASSERT_TRUE(state == after[static_cast<std::size_t>(frame)]) << "frame " << frame;
      }
    }
  }
}

TEST(LargeContact, AMovingHeapIsTheSameOnAnyThreadsAndWithAnyKernels) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  expect_the_same_bits(heap(random, kBodies, 46), constants_of_a_room(50 * kRadius));
}

TEST(LargeContact, SoIsOneWiderThanTheGrid) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
  Random random(kSeed + 1);
  expect_the_same_bits(heap(random, kBodies, 310), constants_of_a_room(400 * kRadius), 2);
}

TEST(LargeContact, SoAreAllBodiesInOneCell) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
  Random random(kSeed + 2);
  State state(kBodies);
  for (Slot s = 0; s < kBodies; ++s) {
    const Vec3i p{random.even(100) + 300, random.even(100) + 300, random.even(100) + 300};
    state.spawn(s, 0, 0, {p, {random.even(1000), 0, 0}, {}, {}});
  }
  expect_the_same_bits(state, constants_of_a_room(50 * kRadius), 2);
}

TEST(LargeContact, SoAreCellsThatAreTooFull) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 3);
  Random random(kSeed + 3);
  State state(kBodies);
  for (Slot s = 0; s < kBodies; ++s) {
    const Vec3i p{random.even(18 * kRadius), random.even(18 * kRadius), random.even(18 * kRadius)};
    state.spawn(s, 0, 1, {p, {random.even(100'000), 0, 0}, {}, {}});
  }
  expect_the_same_bits(state, constants_of_a_room(50 * kRadius), 2);
}

TEST(LargeContact, SoIsAHeapWithABodyAtTheFarEndOfTheWorld) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 4);
  Random random(kSeed + 4);
  State state = heap(random, kBodies, 46);
  state.spawn(7, 1, 0, {{kPositionLimit, kPositionLimit, -kPositionLimit}, {kVelocityLimit, 0, 0}, {}, {}});
  state.spawn(70'000, 1, 0, {{-kPositionLimit, 0, kPositionLimit}, {}, {}, {}});
  expect_the_same_bits(state, constants_of_a_room(50 * kRadius), 2);
}

TEST(LargeContact, SoIsAHeapOfWhichFewMove) {
  for (const std::uint64_t one_in : {2U, 100U, 20'000U, 1'000'000U}) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 5 << ", one in " << one_in << " moves");
    Random random(kSeed + 5);
    State state = heap(random, kBodies, 46);
    const Drive drive = input_at(0).drive;
    for (Slot s = 0; s < kBodies; ++s) {
      if (state.alive()[s] == 0 || random.one_in(one_in)) continue;
      state.rest()[s] = 1;
      // A few rest against another gravity, so that they wake.
      for (std::size_t i = 0; i < 3; ++i) state.c(i)[s] = -drive.gravity[i] - (random.one_in(50'000) ? 1 : 0);
    }
    // The second frame has another gravity: all wake.
    expect_the_same_bits(state, constants_of_a_room(50 * kRadius), 2);
  }
}

// The protocol's grid of such a world has more than sixteen bodies in a cell, most of which it leaves out,
// while the grid that is searched has other proportions.
TEST(LargeContact, SoIsAFlatHeapOfWhichFewMove) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 7);
  Random random(kSeed + 7);
  State state = heap(random, kBodies, 310);
  for (Slot s = 0; s < kBodies; ++s) {
    if (state.alive()[s] == 0 || random.one_in(100)) continue;
    state.rest()[s] = 1;
    for (std::size_t i = 0; i < 3; ++i) state.c(i)[s] = -input_at(0).drive.gravity[i];
  }
  expect_the_same_bits(state, constants_of_a_room(400 * kRadius), 2);
}

// 256 cells are 2^21 grid units here, the range of places in the search, and whole rows of the protocol's
// grid: bodies that far apart are its neighbours.
TEST(LargeContact, SoIsAWorldInWhichPlacesRepeatWithTheGrid) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 8);
  Random random(kSeed + 8);
  ContactConstants constants = constants_of_a_room(400 * kRadius);
  constants.types = {{16'382, 65536}, {8'000, 131072}};
  expect_the_same_bits(heap(random, kBodies, 310), constants, 2);
}

// Each of two cells of the protocol's grid has room for its bodies, the one of the other grid has not.
TEST(LargeContact, SoIsAWorldWithACellThatIsTooFullInTheOtherGridAlone) {
  constexpr std::int32_t kWidth = 10'000, kShift = 2;  // of a cell but one, in grid units
  constexpr std::int32_t kCell = (kWidth + 1) << kShift;
  constexpr auto kCellsPer = static_cast<std::int32_t>((std::uint64_t{1} << 32U) / (kWidth + 1));
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 9);
  Random random(kSeed + 9);
  State state = heap(random, kBodies, 310);
  CellExtent extent;
  for (std::size_t i = 0; i < 3; ++i) {
    extent.low[i] = *std::min_element(state.p(i).begin(), state.p(i).end());
    extent.high[i] = *std::max_element(state.p(i).begin(), state.p(i).end());
  }
  CellChoice choice(6);
  const ContactCellBits chosen = choice.choose(extent, kShift, kCellsPer);
  ASSERT_NE(chosen, choice.protocol());
  const Vec3i here{kCell / 2, 20 * kCell + kCell / 2, kCell / 2};
  const Vec3i there{here[0] + (kCell << chosen.row), here[1] - kCell, here[2]};
  for (Slot s = 0; s < 24; ++s) {
    Vec3i p = s % 2 == 0 ? here : there;
    for (std::int32_t& x : p) x += random.even(1000);
    state.spawn(100 * s, 1, 1, {p, {}, {}, {}});
  }
  expect_the_same_bits(state, constants_of_a_room(800 * kRadius), 2);
  choice.refuse();
  EXPECT_EQ(choice.choose(extent, kShift, kCellsPer), choice.protocol());
}

TEST(LargeContact, SubStepsAreTheSameOnAnyThreadsAndWithAnyKernels) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed + 6);
  Random random(kSeed + 6);
  ContactConstants constants = constants_of_a_room(50 * kRadius);
  constants.substeps = 3;
  for (const bool few_move : {false, true}) {
    State start = heap(random, kBodies, 46);
    for (Slot s = 0; few_move && s < kBodies; ++s) {
      if (start.alive()[s] == 0 || random.one_in(100)) continue;
      start.rest()[s] = 1;
      for (std::size_t i = 0; i < 3; ++i) start.c(i)[s] = -input_at(0).drive.gravity[i];
    }
    expect_the_same_bits(start, constants, 2);
  }
}

}  // namespace
}  // namespace tandem
