// The predicted steps `contact`, `field` and `hard` on a heap of 10,000 bodies at rest in a room, from a
// settled state every time.

#include <benchmark/benchmark.h>

#include <memory>
#include <random>
#include <string_view>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kBodies = 10000;
constexpr std::int32_t kRadius = 20000, kWall = 500000;
constexpr std::uint64_t kSeed = 42;
const StepInput kFalling{{{0, -3000, 0}, 200},
                         {.decay = 0, .contacts = {.listed = true, .friction = 819}},
                         kRadius / 10,
                         {0, -3000, 0}};

std::unique_ptr<Predictor> room(std::string_view tier, std::int32_t substeps) {
  constexpr std::int32_t kOne = ContactConstants::kOne;
  ContactConstants constants;
  constants.substeps = substeps;
  constants.pair = constants.wall = {3641 / substeps, 410 / substeps, 410 / substeps};
  constants.types = {{kRadius, 65536}};
  constants.planes = {{{0, kOne, 0}, 0},
                      {{kOne, 0, 0}, -kWall},
                      {{-kOne, 0, 0}, -kWall},
                      {{0, 0, kOne}, -kWall},
                      {{0, 0, -kOne}, -kWall}};
  return *make_predictor(tier, kBodies, write_contact_constants(constants));
}

void contact_step(benchmark::State& bench, std::string_view tier) {
  const auto predictor = room(tier, static_cast<std::int32_t>(bench.range(0)));
  std::mt19937_64 random(kSeed);
  State heap(kBodies);
  heap.keep_for_predictor(predictor->own_bytes());
  constexpr std::int32_t kSide = 23;
  for (Slot s = 0; s < kBodies; ++s) {
    const auto place = static_cast<std::int32_t>(s);
    const auto jitter = [&random] { return static_cast<std::int32_t>(random() % kRadius); };
    const auto at = [&](std::int32_t cell) { return (2 * cell - kSide) * kRadius + jitter(); };
    heap.spawn(s, 0, 0,
               {{at(place % kSide), 2 * kRadius * (1 + place / (kSide * kSide)) + jitter(),
                 at(place / kSide % kSide)},
                {}});
  }
  for (int frame = 0; frame < 200; ++frame) predictor->step(heap, heap, kFalling);
  State next = heap;
  for (auto _ : bench) predictor->step(heap, next, kFalling);
  bench.SetItemsProcessed(static_cast<std::int64_t>(bench.iterations()) * kBodies);
}
BENCHMARK_CAPTURE(contact_step, contact, "contact")
    ->ArgName("substeps")
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contact_step, field, "field")->ArgName("substeps")->Arg(2)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contact_step, hard, "hard")->ArgName("substeps")->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace tandem
