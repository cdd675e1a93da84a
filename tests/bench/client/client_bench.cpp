// A client's frame and its sample() at 10,000 bodies. Seeded; same bytes every run.

#include <benchmark/benchmark.h>
#include <time.h>

#include "tests/support/client/fake_server.hpp"
#include "tests/support/client/taken.hpp"

namespace tandem::client {
namespace {

constexpr std::uint32_t kBodies = 10000;

// Time of this thread on a core: what others run on the machine does not count.
double now_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

/// A client that plays, without a listener or a test around it.
class World {
 public:
  World() : core_(options(), port_) {
    port_.sessions.push_back(from_server(server_.session));
    poll(kMs);
    deliver();
    port_.snapshots.push_back(from_server(server_.snapshot()));
    poll(kMs);
    for (int i = 0; i < 30; ++i) frame();
  }

  /// One frame is simulated ahead when it is due, and corrected when its delta comes, 5 ms later. Returns the
  /// time that this took.
  double frame() {
    const double ahead_s = poll(kFrameNs - 5 * kMs);
    deliver();
    return ahead_s + poll(5 * kMs);
  }
  bool sample(SampleMode mode) {
    sampled_ns_ += 4 * kMs;
    const SampleColumns columns = sample_.make_room(kBodies);
    return core_.sample({.mode = mode}, columns, {now_ns_ + sampled_ns_ % kFrameNs, 0}).has_value();
  }
  ClientCore& core() { return core_; }

 private:
  static CoreOptions options() {
    CoreOptions options;
    options.session = "default";
    options.id = kClient;
    return options;
  }
  void deliver() { port_.deltas.push_back(from_server(server_.advance(now_ns_))); }
  double poll(std::int64_t later_ns) {
    now_ns_ += later_ns;
    const double began_s = now_s();
    core_.poll({now_ns_, now_ns_});
    return now_s() - began_s;
  }

  FakeServer server_{1000, kBodies};
  FakePort port_;
  ClientCore core_;
  Taken sample_;
  std::int64_t now_ns_ = 1'000'000'000'000;
  std::int64_t sampled_ns_ = 0;
};

void sample(benchmark::State& state, SampleMode mode) {
  World world;
  world.core().start_sampling();
  for (auto _ : state) {
    if (!world.sample(mode)) state.SkipWithError("nothing to draw");
  }
}
BENCHMARK_CAPTURE(sample, interpolate, SampleMode::kInterpolate)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(sample, extrapolate, SampleMode::kExtrapolate)->Unit(benchmark::kMicrosecond);

// The same with orientations. All bodies turn, and are corrected a little in every frame.
void sample_turning(benchmark::State& state, SampleMode mode) {
  const std::vector<std::uint8_t> jumps(kBodies);
  Accelerations steady;
  steady.forget(kBodies);
  std::array<DrawnFrame, 3> frames;
  for (Frame frame = 0; frame < frames.size(); ++frame) {
    State bodies(kBodies, {.orientation = true});
    for (Slot slot = 0; slot < kBodies; ++slot) {
      const auto tilt = static_cast<std::int32_t>(slot * (frame + 1) % 1000) << 10U;
      const Spin spin{1 << 25, tilt, 1 << 24};
      bodies.spawn(slot, 0, 0, {.q = turned(turned(kNoTurn, spin), {tilt, 0, 0}), .w = spin});
    }
    draw(bodies, frame + 1, jumps, steady, frames[frame]);
  }
  Picture picture{.epoch = 1, .lattice_unit = 0.001, .pacer = Pacer(30)};
  picture.before = &frames[0];
  picture.agreed = &frames[1];
  picture.ahead = &frames[2];
  std::int64_t now_ns = 0;
  picture.pacer.on_delta(2, now_ns, now_ns);
  Sampler sampler;
  Taken out;
  for (auto _ : state) {
    if (!out.take(sampler, picture, {.mode = mode}, now_ns)) state.SkipWithError("no room");
    benchmark::DoNotOptimize(out.orientations.data());
    now_ns = (now_ns + 4 * kMs) % (2 * kFrameNs);
  }
}
BENCHMARK_CAPTURE(sample_turning, interpolate, SampleMode::kInterpolate)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(sample_turning, extrapolate, SampleMode::kExtrapolate)->Unit(benchmark::kMicrosecond);

void frame(benchmark::State& state, bool sampling) {
  World world;
  if (sampling) world.core().start_sampling();
  for (auto _ : state) {
    state.SetIterationTime(world.frame());
    if (sampling) world.sample(SampleMode::kExtrapolate);
  }
}
BENCHMARK_CAPTURE(frame, unsampled, false)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(frame, sampled, true)->UseManualTime()->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace tandem::client
