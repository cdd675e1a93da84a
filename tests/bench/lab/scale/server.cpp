#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"
#include "services/engines/background/background.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/waiting.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/child.hpp"
#include "tests/bench/lab/scale/machine.hpp"
#include "tests/bench/lab/scale/scale.hpp"

namespace tandem::lab {
namespace {

/// The histograms of a row.
struct Stages {
  DurationHistogram step, quantise, predict, encode, apply, publish, frame;
  std::uint64_t bytes = 0, corrected = 0, frames = 0;
  std::uint64_t colliding = 0, looked = 0;  // sum over the frames after which the engine could be asked

  void add(const host::FrameReport& report) {
    const host::DeltaReport& delta = report.deltas.front();
    const auto ns = [](double ms) { return static_cast<std::int64_t>(ms * 1e6); };
    step.add(ns(report.step_ms));
    predict.add(delta.predict_ns);
    encode.add(delta.encode_ns);
    apply.add(delta.apply_ns);
    quantise.add(ns(report.frame_ms - report.step_ms) - delta.predict_ns - delta.encode_ns - delta.apply_ns);
    frame.add(ns(report.frame_ms));
    bytes += delta.payload_bytes;
    corrected += delta.corrected;
    ++frames;
  }
};

StageTime of(const DurationHistogram& histogram) {
  return {histogram.quantile_ms(0.5), histogram.quantile_ms(0.99)};
}

StageTime of(const Json& json) { return {json["p50"].number(), json["p99"].number()}; }

double standing_share(const engine::Simulation& simulation) {
  const engine::Bodies bodies = simulation.bodies();
  std::size_t alive = 0, standing = 0;
  for (std::size_t slot = 0; slot < bodies.alive.size(); ++slot) {
    if (bodies.alive[slot] == 0) continue;
    ++alive;
    if (bodies.velocity[0][slot] == 0 && bodies.velocity[1][slot] == 0 && bodies.velocity[2][slot] == 0)
      ++standing;
  }
  return alive == 0 ? 1 : static_cast<double>(standing) / static_cast<double>(alive);
}

/// Steps the engine before its session begins; returns how often. In a world that settles nobody acts
/// meanwhile.
std::uint64_t warm_up(Source& source, const ScaleSetup& setup, std::size_t& next_input) {
  constexpr std::uint64_t kLookEvery = 25;
  constexpr double kNearlyAll = 0.9999;
  const bool settles = setup.motion != Motion::kMoving;
  auto later = settles ? std::exchange(source.script, {}) : decltype(source.script){};
  std::uint64_t step = 0;
  while (step < setup.warm_up && !*setup.stop) {
    ++step;
    for (; next_input < source.script.size() && source.script[next_input].frame <= step; ++next_input)
      source.simulation->apply(source.script[next_input].input);
    source.simulation->step();
    if (settles && step % kLookEvery == 0 && standing_share(*source.simulation) >= kNearlyAll) break;
  }
  if (setup.motion == Motion::kStirred) {
    source.script = std::move(later);
    for (auto& each : source.script) each.frame += step;
  }
  return step;
}

Result<std::unique_ptr<transport::ServerPort>> open_port(const host::HostConfig& config,
                                                         const ScaleSetup& setup) {
  const auto largest = host::largest_delta_bytes(config.streams);
  if (!largest) return tl::unexpected(largest.error());
  transport::DdsOptions dds;
  dds.domain = setup.domain;
  dds.session = config.session;
  dds.profile = "loopback";
  dds.delta_depth = transport::delta_depth(config.frame_rate_hz, config.window_ceiling, *largest);
  dds.stop = setup.stop;
  return transport::make_dds_server_port(dds);
}

/// Serves until `frames` frames were produced while the client played.
Result<void> serve(host::Host& host, transport::ServerPort& port, Source& source, const ScaleSetup& setup,
                   std::uint64_t warmed_up, std::size_t next_input, Stages& stages) {
  const std::int64_t end_ns = steady_ns() + static_cast<std::int64_t>(setup.patience_s * 1e9);
  while (stages.frames < setup.frames) {
    if (*setup.stop) return fail(ErrorCode::kIo, "stopped");
    const std::int64_t now_ns = steady_ns();
    if (now_ns > end_ns)
      return fail(ErrorCode::kTimeout,
                  fmt::format("only {} of {} frames in {} s", stages.frames, setup.frames, setup.patience_s));
    if (host.state() == host::Host::State::kRefused || host.state() == host::Host::State::kEnded)
      return tl::unexpected(*host.error());
    for (;
         next_input < source.script.size() && source.script[next_input].frame <= warmed_up + host.frame() + 2;
         ++next_input) {
      static_cast<void>(host.inject(source.script[next_input].input));
    }
    const bool produced = host.poll(now_ns, transport::wall_ns());
    const std::int64_t began_ns = steady_ns();
    if (auto drained = host::drain(host.outbox(), port); !drained) return drained;
    static_cast<void>(host.take_notices());
    if (produced) {
      stages.publish.add(steady_ns() - began_ns);
      stages.add(host.report());
      if (!host.frame_under_way()) {
        stages.colliding += source.simulation->colliding();
        ++stages.looked;
      }
    }
    host::wait_for_work(host, port, std::chrono::nanoseconds(host.next_wake_ns() - steady_ns()));
  }
  return {};
}

}  // namespace

Result<ScaleRow> measure_scale(const scenes::Scene& scene, const ScaleSetup& setup) {
  auto config = sessions::plan_session(scene, setup.choice);
  if (!config) return tl::unexpected(config.error());
  if (config->streams.size() > 1) config->streams.resize(1);
  config->session = fmt::format("bench-scale-{}", getpid());
  config->epoch = static_cast<Epoch>(transport::wall_ns() / 1'000'000);
  config->wait_for = 1;
  config->stall_timeout_ns.reset();
  config->clock_ns = &steady_ns;

  const std::int64_t heap_at_start = heap_bytes();
  auto source = make_source(scene, {.bodies = setup.choice.bodies,
                                    .seed = setup.seed,
                                    .threads = setup.threads,
                                    .frames = setup.warm_up + setup.frames + 1});
  if (!source) return tl::unexpected(source.error());
  const std::int64_t heap_with_engine = heap_bytes();
  std::size_t next_input = 0;
  ScaleRow row;
  row.warm_up = warm_up(*source, setup, next_input);
  row.standing = standing_share(*source->simulation);
  config->pipeline = setup.pipeline;
  if (setup.pipeline) {
    auto apart = engine::step_in_background(std::move(source->simulation));
    if (!apart) return tl::unexpected(apart.error());
    source->simulation = std::move(*apart);
  }

  auto port = open_port(*config, setup);
  if (!port) return tl::unexpected(port.error());
  const std::int64_t heap_before_host = heap_bytes();
  const std::string session = config->session;
  auto host = host::Host::create(std::move(*config), *source->simulation, **port);
  if (!host) return tl::unexpected(host.error());
  auto client = Child::start({own_path(), "scale", "--play", session, "--domain",
                              std::to_string(setup.domain), "--frames", std::to_string(setup.frames)},
                             {});
  if (!client) return tl::unexpected(client.error());
  const std::int64_t began_ns = steady_ns();
  Stages stages;
  if (auto served = serve(**host, **port, *source, setup, row.warm_up, next_input, stages); !served)
    return tl::unexpected(served.error());
  const double bodies = setup.choice.bodies;
  row.engine_bytes = static_cast<double>(heap_with_engine - heap_at_start) / bodies;
  row.server_bytes = static_cast<double>(heap_bytes() - heap_before_host) / bodies;
  const auto said = client->finish(kChildEnd, *setup.stop);
  if (!said) return fail(said.error().code, "the client: " + said.error().message);
  const auto printed = Json::parse(*said);
  if (!printed) return fail(ErrorCode::kIo, "the client printed no JSON");

  row.step = of(stages.step);
  row.quantise = of(stages.quantise);
  row.predict = of(stages.predict);
  row.encode = of(stages.encode);
  row.apply = of(stages.apply);
  row.publish = of(stages.publish);
  row.frame = of(stages.frame);
  row.client_predict = of((*printed)["predict_ms"]);
  row.client_decode = of((*printed)["decode_ms"]);
  row.client_apply = of((*printed)["apply_ms"]);
  row.client_bytes = (*printed)["heap_bytes"].number() / bodies;
  const auto frames = static_cast<double>(stages.frames);
  row.mbit_per_s = 8 * static_cast<double>(stages.bytes) / frames / scene.dt_s / kBitsPerMbit;
  row.frames_per_s = frames * 1e9 / static_cast<double>(steady_ns() - began_ns);
  row.corrected_per_frame = static_cast<double>(stages.corrected) / frames;
  if (stages.looked > 0)
    row.colliding_per_frame = static_cast<double>(stages.colliding) / static_cast<double>(stages.looked);
  return row;
}

}  // namespace tandem::lab
