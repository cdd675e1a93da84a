// The predicted step `rigid`: cubes, or bodies of many shapes, that fall into a heap in a room.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string_view>

#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem {
namespace {

constexpr std::int32_t kHalf = 20000;
constexpr std::int32_t kThreshold = kHalf / 10;  // 5 % of a cube
constexpr std::uint64_t kSeed = 42;
const StepInput kFalling{{{0, -3000 * 8, 0}, 200},
                         {.decay = 800, .contacts = {.listed = true, .friction = 1024}},
                         kThreshold,
                         {0, -3000 * 8, 0}};

RigidConstants room_of(std::int32_t half_width) {
  constexpr std::int32_t kOne = ContactConstants::kOne;
  RigidConstants constants;
  constants.contact.substeps = 2;
  constants.contact.types.assign(4, {kHalf, 65536});
  constants.contact.planes = {{{0, kOne, 0}, 0},
                              {{kOne, 0, 0}, -half_width},
                              {{-kOne, 0, 0}, -half_width},
                              {{0, 0, kOne}, -half_width},
                              {{0, 0, -kOne}, -half_width}};
  constants.solids = {{Solid::Kind::kBox, {kHalf, kHalf, kHalf}},
                      {Solid::Kind::kBox, {kHalf * 3 / 2, kHalf / 2, kHalf}},
                      {Solid::Kind::kRound, {kHalf / 2, kHalf / 2, 0}},
                      {Solid::Kind::kRound, {kHalf * 3 / 4, 0, 0}}};
  return constants;
}

// Moves and pushes some bodies by up to half a threshold.
void correct(State& heap, std::int32_t count, std::mt19937_64& random) {
  const auto within = [&random](std::int32_t limit) {
    return static_cast<std::int32_t>(random() % (2 * static_cast<std::uint64_t>(limit) + 1)) - limit;
  };
  for (std::int32_t i = 0; i < count; ++i) {
    const auto s = static_cast<Slot>(random() % heap.capacity());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      heap.p(axis)[s] += within(kThreshold / 2);
      heap.v(axis)[s] += within(kThreshold / 2 * 10);
    }
  }
}

struct Heap {
  std::int64_t bodies, shapes, frames;
};

// A loose block above the floor, after some steps; of cubes alone, or of four shapes. `corrected`: so many
// are corrected in each further frame, otherwise the same frame is measured again and again.
void step_heap(benchmark::State& bench, const Heap& of, std::int32_t corrected) {
  const auto bodies = static_cast<std::uint32_t>(of.bodies);
  const auto side = static_cast<std::int32_t>(std::cbrt(bodies));
  const auto predictor =
      *make_predictor("rigid", bodies, write_rigid_constants(room_of((side * 3 / 2 + 2) * kHalf)));
  State heap(bodies, {.orientation = true});
  heap.keep_for_predictor(predictor->own_bytes());
  std::mt19937_64 random(kSeed);
  for (Slot s = 0; s < bodies; ++s) {
    const auto place = static_cast<std::int32_t>(s);
    const auto some = [&random](std::int32_t most) {
      return static_cast<std::int32_t>(random() % static_cast<std::uint64_t>(2 * most)) - most;
    };
    const auto at = [&](std::int32_t cell) { return (3 * cell - side * 3 / 2) * kHalf + some(kHalf / 2); };
    Quaternion q = kNoTurn;
    for (int i = 0; i < 3; ++i) q = turned(q, {some(1 << 28), some(1 << 28), some(1 << 28)});
    heap.spawn(
        s, 0, static_cast<TypeId>(place % of.shapes),
        {{at(place % side), 3 * kHalf * (1 + place / (side * side)), at(place / side % side)}, {}, q, {}});
  }
  for (std::int64_t frame = 0; frame < of.frames; ++frame) predictor->step(heap, heap, kFalling);
  const auto asleep = [&heap] {
    return static_cast<double>(std::count(heap.own().begin(), heap.own().end(), 5));
  };
  bench.counters["asleep"] = asleep();
  State next = heap;
  for (auto _ : bench) {
    if (corrected == 0) {
      predictor->step(heap, next, kFalling);
    } else {
      correct(heap, corrected, random);
      predictor->step(heap, heap, kFalling);
    }
  }
  bench.counters["asleep_after"] = asleep();
  bench.SetItemsProcessed(bench.iterations() * bodies);
}

void rigid_step(benchmark::State& bench) {
  step_heap(bench, {bench.range(0), bench.range(1) != 0 ? 4 : 1, bench.range(2)}, 0);
}
BENCHMARK(rigid_step)
    ->ArgNames({"bodies", "shapes", "frames"})
    ->ArgsProduct({{2000}, {0, 1}, {25, 50, 100, 150, 400}})
    ->Unit(benchmark::kMicrosecond);

void rigid_asleep(benchmark::State& bench) {
  step_heap(bench, {2000, 1, 1500}, static_cast<std::int32_t>(bench.range(0)));
}
// In the same frames every time, because a heap that is pushed again and again does not stay asleep.
BENCHMARK(rigid_asleep)
    ->ArgName("corrected")
    ->Arg(1)
    ->Arg(10)
    ->Arg(100)
    ->Iterations(50)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace tandem
