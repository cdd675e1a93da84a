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

/// `count` bodies in layers of `side` a side, in any order of slots or from the lowest layer up, with some
/// slots dead.
State heap(Random& random, std::uint32_t count, std::int32_t side, bool ordered = false) {
  State state(count);
  std::vector<Slot> slots(count);
  std::iota(slots.begin(), slots.end(), Slot{0});
  for (std::uint32_t k = count - 1; k > 0 && !ordered; --k) std::swap(slots[k], slots[random.below(k + 1)]);
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

void put_to_rest(State& state, Slot slot, const Drive& drive) {
  state.rest()[slot] = 1;
  for (std::size_t i = 0; i < 3; ++i) state.c(i)[slot] = -drive.gravity[i];
}

/// What a delta may do: bodies of one block move to others, bodies of another block come to rest beside them,
/// and bodies appear and disappear. Returns the slots, ascending.
std::vector<Slot> touch_some(Random& random, State& state, const Drive& drive) {
  std::vector<Slot> touched;
  const auto put = [&](Slot slot, const Vec3i& p) {
    if (state.alive()[slot] == 0) state.spawn(slot, 1, 0, {p, {}, {}, {}});
    for (std::size_t i = 0; i < 3; ++i) state.p(i)[slot] = p[i];
    state.rest()[slot] = 0;
    touched.push_back(slot);
  };
  for (int i = 0; i < 4; ++i) {
    const auto other = static_cast<Slot>(random.below(2 * kBlockSlots));  // the fourth block is elsewhere
    Vec3i near{state.p(0)[other], state.p(1)[other], state.p(2)[other]};
    for (std::int32_t& x : near) x += random.even(kRadius);
    put(2 * kBlockSlots + static_cast<Slot>(random.below(kBlockSlots)), near);
    near[1] += kRadius;
    put(4 * kBlockSlots + static_cast<Slot>(random.below(kBlockSlots)), near);
    put_to_rest(state, touched.back(), drive);
  }
  put(state.capacity() - 1, {});
  put_to_rest(state, touched.back(), drive);
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  if (random.one_in(2)) state.despawn(touched.front());
  return touched;
}

struct Played {
  StepInput input;
  State after;  // the step; a delta follows
};

/// Frames in each of which a delta touches a few bodies.
std::vector<Played> play_slowly(State state, const ContactConstants& constants) {
  constexpr int kFrames = 6, kTurns = 4;  // gravity turns in that frame, and wakes all
  std::vector<Played> played;
  SlowContact slow(state.capacity(), constants);
  for (int frame = 0; frame < kFrames; ++frame) {
    StepInput input = input_at(frame < kTurns ? 0 : 1);
    input.gravity_before = input_at(frame <= kTurns ? 0 : 1).drive.gravity;
    slow.step(state, input);
    played.push_back({input, state});
    Random random(kSeed + 20 + static_cast<std::uint64_t>(frame));
    touch_some(random, state, input.drive);
  }
  return played;
}

/// Plays them with what the ledgers of `states` states in turn say: one as on a server, or more as on a
/// client.
void expect_the_same_bits_by_ledgers(const State& start, const ContactConstants& constants,
                                     const std::vector<Played>& expected, std::size_t states,
                                     std::uint32_t threads) {
  SCOPED_TRACE(testing::Message() << states << " states, " << threads << " threads");
  Contact contact(start.capacity(), constants);
  const RunBlocks run = threads > 0 ? on_threads(threads) : RunBlocks{};
  contact.spread_by(run);
  struct Held {
    State state;
    BlockLedger ledger;
  };
  std::vector<Held> ring(states, {start, BlockLedger(start.capacity())});
  std::uint64_t number = 0;
  for (Held& held : ring) held.ledger.renew_all(++number);
  for (std::size_t frame = 0; frame < expected.size(); ++frame) {
    const auto& [input, after] = expected[frame];
    const Held& from = ring[frame % states];
    Held& to = ring[(frame + 1) % states];
    contact.step_blocks(from.state, to.state, input, {from.ledger, to.ledger, ++number, run});
    ASSERT_TRUE(to.state == after) << "frame " << frame;
    Random random(kSeed + 20 + frame);
    to.ledger.renew_blocks_of(touch_some(random, to.state, input.drive), ++number);
  }
}

// Layer upon layer, so that most blocks of slots lie far from those in which bodies move. Some bodies share a
// cell with many of other blocks.
TEST(LargeContact, BlocksAtRestAreLeftOutUntilSomebodyMovesNearThem) {
  for (const std::int32_t side : {46, 310}) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 10 << ", side " << side);
    Random random(kSeed + 10);
    State state = heap(random, kBodies, side, true);
    const Drive drive = input_at(0).drive;
    for (Slot s = 0; s < kBodies; ++s) {
      if (state.alive()[s] != 0 && (s / kBlockSlots != 2 || !random.one_in(500)))
        put_to_rest(state, s, drive);
    }
    for (Slot s = 40; s < kBodies; s += 1500) {
      for (std::size_t i = 0; i < 3 && state.alive()[s] != 0; ++i) state.p(i)[s] = 300 + random.even(9000);
    }
    const ContactConstants constants = constants_of_a_room(8 * side * kRadius);
    const std::vector<Played> expected = play_slowly(state, constants);
    expect_the_same_bits_by_ledgers(state, constants, expected, 1, 0);
    expect_the_same_bits_by_ledgers(state, constants, expected, 1, 3);
    expect_the_same_bits_by_ledgers(state, constants, expected, 2, 2);
    expect_the_same_bits_by_ledgers(state, constants, expected, 3, 0);
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

// A world of one block of slots has grids of its own, too.
TEST(LargeContact, SoAreSmallFlatHeaps) {
  for (const std::int32_t side : {60, 100}) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 11 << ", side " << side);
    Random random(kSeed + 11);
    State state = heap(random, 10'000, side);
    const ContactConstants constants = constants_of_a_room(2 * side * kRadius);
    expect_the_same_bits(state, constants, 4);
    for (Slot s = 0; s < state.capacity(); ++s) {
      if (state.alive()[s] != 0 && !random.one_in(50)) put_to_rest(state, s, input_at(0).drive);
    }
    expect_the_same_bits(state, constants, 2);
    // More than sixteen bodies in one cell.
    for (Slot s = 0; s < 400; ++s) {
      for (std::size_t i = 0; i < 3 && state.alive()[s] != 0; ++i) state.p(i)[s] = 300 + random.even(9000);
    }
    expect_the_same_bits(state, constants, 2);
  }
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
  struct World {
    std::uint32_t bodies;
    std::int32_t side;
    std::uint32_t side_bits;  // of the protocol's grid
  };
  for (const World& world : {World{kBodies, 310, 6}, World{10'000, 100, 5}}) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 9 << ", " << world.bodies << " bodies");
    Random random(kSeed + 9);
    State state = heap(random, world.bodies, world.side);
    CellExtent extent;
    for (std::size_t i = 0; i < 3; ++i) {
      extent.low[i] = *std::min_element(state.p(i).begin(), state.p(i).end());
      extent.high[i] = *std::max_element(state.p(i).begin(), state.p(i).end());
    }
    CellChoice choice(world.side_bits);
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
