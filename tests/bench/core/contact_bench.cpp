// The predicted steps `contact`, `field` and `hard` on a heap of 10,000 bodies at rest in a room, from a
// settled state every time, and `hard` on other heaps: bodies that fall, that move in a heap, that hardly
// move any more (most sleep), and a heap asleep of which some are corrected in each frame.

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>
#include <string_view>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kBodies = 10000;
constexpr std::int32_t kRadius = 20000;
constexpr std::uint64_t kSeed = 42;
const StepInput kFalling{{{0, -3000, 0}, 200},
                         {.decay = 0, .contacts = {.listed = true, .friction = 819}},
                         kRadius / 10,
                         {0, -3000, 0}};

// A heap in a room, some frames after it began to fall. Every other body of two types is smaller.
struct Heap {
  std::uint32_t bodies = kBodies;
  std::int32_t types = 1, frames = 200, corrected = 0;
};

// Moves and pushes some bodies by up to half a threshold.
void correct(State& heap, std::int32_t count, std::mt19937_64& random) {
  const auto within = [&random](std::int32_t limit) {
    return static_cast<std::int32_t>(random() % (2 * static_cast<std::uint64_t>(limit) + 1)) - limit;
  };
  for (std::int32_t i = 0; i < count; ++i) {
    const auto s = static_cast<Slot>(random() % heap.capacity());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      heap.p(axis)[s] += within(kRadius / 20);
      heap.v(axis)[s] += within(kRadius / 2);
    }
  }
}

void step_heap(benchmark::State& bench, std::string_view tier, std::int32_t substeps, const Heap& wanted) {
  constexpr std::int32_t kOne = ContactConstants::kOne;
  const auto side = static_cast<std::int32_t>(std::cbrt(wanted.bodies) * 1.07);
  const std::int32_t wall = (side + 2) * kRadius;
  ContactConstants constants;
  constants.substeps = substeps;
  constants.pair = constants.wall = {3641 / substeps, 410 / substeps, 410 / substeps};
  constants.types = {{kRadius, 65536}, {kRadius * 3 / 5, 200000}};
  constants.types.resize(static_cast<std::size_t>(wanted.types));
  constants.planes = {{{0, kOne, 0}, 0},
                      {{kOne, 0, 0}, -wall},
                      {{-kOne, 0, 0}, -wall},
                      {{0, 0, kOne}, -wall},
                      {{0, 0, -kOne}, -wall}};
  const auto predictor = *make_predictor(tier, wanted.bodies, write_contact_constants(constants));
  std::mt19937_64 random(kSeed);
  State heap(wanted.bodies);
  heap.keep_for_predictor(predictor->own_bytes());
  for (Slot s = 0; s < wanted.bodies; ++s) {
    const auto place = static_cast<std::int32_t>(s);
    const auto jitter = [&random] { return static_cast<std::int32_t>(random() % kRadius); };
    const auto at = [&](std::int32_t cell) { return (2 * cell - side) * kRadius + jitter(); };
    heap.spawn(
        s, 0, static_cast<TypeId>(place % wanted.types),
        {{at(place % side), 2 * kRadius * (1 + place / (side * side)) + jitter(), at(place / side % side)},
         {}});
  }
  for (int frame = 0; frame < wanted.frames; ++frame) predictor->step(heap, heap, kFalling);
  State next = heap;
  for (auto _ : bench) {
    if (wanted.corrected == 0) {
      predictor->step(heap, next, kFalling);
    } else {
      correct(heap, wanted.corrected, random);
      predictor->step(heap, heap, kFalling);
    }
  }
  bench.SetItemsProcessed(static_cast<std::int64_t>(bench.iterations()) * wanted.bodies);
}

void contact_step(benchmark::State& bench, std::string_view tier) {
  step_heap(bench, tier, static_cast<std::int32_t>(bench.range(0)), {});
}
BENCHMARK_CAPTURE(contact_step, contact, "contact")
    ->ArgName("substeps")
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contact_step, field, "field")->ArgName("substeps")->Arg(2)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contact_step, hard, "hard")->ArgName("substeps")->Arg(1)->Unit(benchmark::kMicrosecond);

void hard_step(benchmark::State& bench) {
  step_heap(bench, "hard", 1,
            {static_cast<std::uint32_t>(bench.range(0)), static_cast<std::int32_t>(bench.range(1)),
             static_cast<std::int32_t>(bench.range(2))});
}
BENCHMARK(hard_step)
    ->ArgNames({"bodies", "types", "frames"})
    ->ArgsProduct({{1000, 10000}, {1, 2}, {5, 25, 60, 200}})
    ->Unit(benchmark::kMicrosecond);

void hard_asleep(benchmark::State& bench) {
  step_heap(bench, "hard", 1, {.frames = 900, .corrected = static_cast<std::int32_t>(bench.range(0))});
}
// In the same frames every time, because a heap that is pushed again and again does not stay asleep.
BENCHMARK(hard_asleep)
    ->ArgName("corrected")
    ->Arg(1)
    ->Arg(10)
    ->Arg(100)
    ->Iterations(50)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace tandem
