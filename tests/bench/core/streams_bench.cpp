// A server's whole frame with one stream and with two, of half_pipe with 10,000 bodies and its script.

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <optional>

#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/wire/clock.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/scenes/script.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/frames/live_source.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kBodies = 10'000;
constexpr std::uint64_t kSeed = 1;
constexpr Frame kWarmUp = 300;  // until the bodies lie

// Wall-clock time: the streams are to be made side by side.
void server_frame(benchmark::State& state, host::StreamSet active) {
  const scenes::Scene scene = scenes::load_scene("half_pipe").value();
  sessions::SessionChoice choice;
  choice.bodies = kBodies;
  choice.streams = planning::usual_streams(sessions::world_of(scene, kBodies), choice).value();
  host::HostConfig config = sessions::plan_session(scene, choice).value();
  config.clock_ns = &transport::steady_ns;
  const auto simulation = scenes::make_simulation(scene, kBodies, kSeed, 1).value();
  const auto source = host::LiveSource::create(config, *simulation).value();
  source->set_active(active);
  scenes::Script script(scene, kSeed, 0);
  host::Outbox outbox({});
  DurationHistogram frames, steps;
  const auto advance = [&](bool measured) {
    for (const auto& due : script.until(source->frame() + 3))
      static_cast<void>(source->accept(
          {.kind = due.input.kind, .values = due.input.values, .bytes = due.input.bytes}, {}, outbox));
    const std::int64_t began_ns = transport::steady_ns();
    const auto made = source->next({}, outbox);
    const std::int64_t took_ns = transport::steady_ns() - began_ns;
    while (outbox.pop(std::chrono::nanoseconds{0})) {
    }
    if (!measured) return;
    frames.add(took_ns);
    steps.add(made->step_ns);
  };
  while (source->frame() < kWarmUp) advance(false);
  for (auto _ : state) advance(true);
  state.counters["p50_us"] = 1e3 * frames.quantile_ms(0.5);
  state.counters["step_p50_us"] = 1e3 * steps.quantile_ms(0.5);
}

BENCHMARK_CAPTURE(server_frame, thin, host::StreamSet(1))->Iterations(600)->UseRealTime();
BENCHMARK_CAPTURE(server_frame, rich, host::StreamSet(2))->Iterations(600)->UseRealTime();
BENCHMARK_CAPTURE(server_frame, thin_and_rich, host::StreamSet(3))->Iterations(600)->UseRealTime();

}  // namespace
}  // namespace tandem
