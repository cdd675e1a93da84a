// A step at the bound of idl/PROTOCOL.md, "Work of a step", in about its worst state: a heap of bodies, all
// of them within all shapes. It may take 20 periods of 30 Hz.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem {
namespace {

constexpr std::int32_t kRadius = 20'000;

// As many solids as the bound allows, half of them boxes, and then planes.
ContactConstants constants_at_bound(const PredictorTraits& traits, std::uint32_t capacity,
                                    std::int32_t substeps) {
  constexpr std::int32_t kOne = ContactConstants::kOne;
  const auto times = traits.work.each_substep ? static_cast<std::uint64_t>(substeps) : 1;
  std::uint64_t left = kMaxStepWork / capacity / times - traits.work.body;
  const auto take = [&left](std::uint64_t most, std::uint64_t each) {
    const std::uint64_t count = std::min({most, left / each, std::uint64_t{ContactConstants::kMaxShapes}});
    left -= count * each;
    return static_cast<std::size_t>(count);
  };
  const std::uint64_t solids = left / traits.work.solid;
  ContactConstants constants;
  constants.substeps = substeps;
  constants.pair = constants.wall = {3641 / substeps, 410 / substeps, 410 / substeps};
  constants.types = {{kRadius, 65536}};
  constants.boxes.assign(
      take(solids / 2, traits.work.solid),
      {{},
       {kOne / 4, kOne / 4, kOne / 4},
       {{{kOne / 5 * 3, kOne / 5 * 4, 0}, {-kOne / 5 * 4, kOne / 5 * 3, 0}, {0, 0, kOne}}}});
  constants.balls.assign(take(solids, traits.work.solid), {{1, 7, 0}, kOne / 2});
  constants.planes.assign(take(left, traits.work.plane), {{0, kOne, 0}, kOne / 2});
  return constants;
}

void step_at_bound(benchmark::State& run, const char* name) {
  const PredictorTraits& traits = **find_predictor(name);
  const auto capacity = static_cast<std::uint32_t>(run.range(0));
  const auto substeps = static_cast<std::int32_t>(run.range(1));
  const ContactConstants constants = constants_at_bound(traits, capacity, substeps);
  const auto values =
      traits.reads_shapes
          ? write_rigid_constants({constants, {{Solid::Kind::kBox, {kRadius, kRadius, kRadius}}}})
          : write_contact_constants(constants);
  const auto predictor = make_predictor(name, capacity, values);
  if (!predictor) {
    run.SkipWithError(predictor.error().message.c_str());
    return;
  }
  Dice dice(1);
  State state(capacity, {.orientation = traits.reads_shapes});
  state.keep_for_predictor((*predictor)->own_bytes());
  const auto side = static_cast<std::uint32_t>(std::cbrt(capacity)) + 1;
  const auto near = [&dice](std::uint32_t cell) {
    return static_cast<std::int32_t>(cell) * (2 * kRadius - 2000) +
           static_cast<std::int32_t>(dice.below(5000));
  };
  for (Slot s = 0; s < capacity; ++s)
    state.spawn(s, 0, 0,
                {.p = {near(s % side), near(s / side % side), near(s / side / side)}, .v = {64, 0, 0}});
  StepInput input{{{0, -28'000, 0}, 200}, {800}, kRadius / 10, {0, -28'000, 0}};
  if (traits.hard_contacts) input.parameters.contacts = {true, 0, 0, 2000, 0};
  State next = state;
  for (auto _ : run) (*predictor)->step(state, next, input);
}

BENCHMARK_CAPTURE(step_at_bound, field, "field")
    ->Args({1 << 16, 1})
    ->Args({1 << 20, 1})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(step_at_bound, contact, "contact")
    ->Args({1 << 14, 4})
    ->Args({1 << 14, 16})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(step_at_bound, hard, "hard")
    ->Args({1 << 14, 1})
    ->Args({1 << 18, 1})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(step_at_bound, rigid, "rigid")
    ->Args({1 << 11, 8})
    ->Args({1 << 14, 8})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tandem
