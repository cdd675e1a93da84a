// The cost that orientations add to a predicted step: 10,000 bodies turned in place, one in `resting` at
// rest.

#include <benchmark/benchmark.h>

#include "sdk/core/lattice/state.hpp"
#include "tests/property/random.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kBodies = 10000;
constexpr std::uint64_t kSeed = 42;

void turn(benchmark::State& bench) {
  synthetic::Random random(kSeed);
  State state(kBodies, {.orientation = true});
  const auto resting = static_cast<Slot>(bench.range(0));
  for (Slot slot = 0; slot < kBodies; ++slot) {
    BodyState body;
    body.q = synthetic::any_quaternion(random);
    body.w = synthetic::any_spin(random);
    state.spawn(slot, 0, 0, body);
    state.rest()[slot] = static_cast<std::uint8_t>(resting != 0 && slot % resting == 0);
  }
  for (auto _ : bench) {
    step_groups(state, state);
    benchmark::ClobberMemory();
  }
  bench.SetItemsProcessed(static_cast<std::int64_t>(bench.iterations()) * kBodies);
  using Counter = benchmark::Counter;
  bench.counters["time_a_body"] = Counter(kBodies, Counter::kIsIterationInvariantRate | Counter::kInvert);
}
BENCHMARK(turn)->ArgName("resting")->Arg(0)->Arg(2)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace tandem
