// The time that the codec `tracker` takes for a correction where crowds move: encoding, and decoding and
// applying, on one thread. Seeded; same bytes every run.

#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "services/host/streams/stream.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kBodies = 8 * kBlockSlots;
constexpr std::uint64_t kSeed = 1;

// Time of this thread on a core: what others run on the machine does not count.
std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// A server of one stream, and what its bodies do. No body appears or goes.
class Crowd {
 public:
  Crowd() = default;
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;
  virtual ~Crowd() = default;
  [[nodiscard]] virtual const Layout& layout() const = 0;
  virtual void snapshot(std::vector<std::byte>& out) = 0;
  virtual ServerTimeline::FrameResult advance() = 0;
};

// half_pipe while its bodies fall, without its script.
class FallingCrowd final : public Crowd {
 public:
  /// `share`: of the scene's threshold.
  explicit FallingCrowd(double share) {
    const scenes::Scene scene = scenes::load_scene("half_pipe").value();
    sessions::SessionChoice choice;
    choice.bodies = kBodies;
    choice.predictor = "ballistic";
    choice.threshold_scale = share;
    const auto planned = sessions::plan_stream(scene, choice).value();
    simulation_ = scenes::make_simulation(scene, kBodies, kSeed, 1).value();
    mirror_.emplace(host::make_mirror({&planned, 1}, simulation_->bodies()).value());
    const Drive drive =
        host::to_drive(planned.lattice, simulation_->gravity(), simulation_->damping_per_s()).value();
    stream_.emplace(host::Stream::create(planned, {.mirror = *mirror_, .drive = drive}).value());
    stream_->set_clock(now_ns);
  }
  [[nodiscard]] const Layout& layout() const override { return stream_->config().layout; }
  void snapshot(std::vector<std::byte>& out) override { stream_->snapshot(out); }
  ServerTimeline::FrameResult advance() override {
    simulation_->step();
    mirror_->update(simulation_->bodies(), simulation_->events());
    return stream_->produce(*mirror_);
  }

 private:
  std::unique_ptr<engine::Simulation> simulation_;
  std::optional<host::Mirror> mirror_;
  std::optional<host::Stream> stream_;
};

// Bodies that stay where they are predicted, but for one in `pushed_one_in`.
class PushedCrowd final : public Crowd {
 public:
  PushedCrowd(std::uint32_t bodies, std::uint64_t pushed_one_in, const Groups& groups)
      : pushed_one_in_(pushed_one_in), target_(bodies, groups) {
    layout_.capacity = bodies;
    layout_.type_count = synthetic::kTypes;
    layout_.parameters = {{4096, 256, 1024}};
    if (groups.orientation) {
      layout_.groups.push_back(kOrientationGroup);
      layout_.radii.assign(synthetic::kTypes, 20'000);
    }
    for (Slot slot = 0; slot < bodies; ++slot) {
      BodyState body;
      for (std::int32_t& p : body.p) p = random_.even(1 << 22);
      for (std::int32_t& v : body.v) v = random_.even(1 << 12);
      if (groups.orientation) body.q = synthetic::any_quaternion(random_);
      target_.spawn(slot, 0, 1, body);
    }
    server_.emplace(*ServerTimeline::create(layout_, 1));
    server_->set_clock(now_ns);
    server_->start(0, target_, kDrive);
  }
  [[nodiscard]] const Layout& layout() const override { return layout_; }
  void snapshot(std::vector<std::byte>& out) override { server_->snapshot(out); }
  ServerTimeline::FrameResult advance() override {
    ballistic_.step(server_->state(), target_, {kDrive, layout_.parameters.step});
    for (Slot slot = 0; slot < target_.capacity(); ++slot) {
      if (!random_.one_in(pushed_one_in_)) continue;
      BodyState body = target_.body(slot);
      body.p[random_.below(3)] += random_.one_in(2) ? 5000 : -5000;
      for (std::int32_t& p : body.p) p += random_.even(800);
      if (target_.groups().orientation && random_.one_in(2))
        body.q = turned(body.q, {random_.even(1 << 26), random_.even(1 << 26), random_.even(1 << 26)});
      target_.set_body(slot, body);
    }
    return server_->advance(target_, {});
  }

 private:
  static constexpr Drive kDrive{{0, 0, 0}, 300};

  std::uint64_t pushed_one_in_;
  synthetic::Random random_{kSeed};
  Layout layout_;
  State target_;
  Ballistic ballistic_;
  std::optional<ServerTimeline> server_;
};

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// `make` makes the crowd. The first `warm` frames teach the models, the next ones are measured.
template <class Make>
void tracker_crowd(benchmark::State& bench, const Make& make, int warm) {
  constexpr int kMeasured = 20;
  std::vector<double> encode_ns, decode_ns;
  double corrected = 0, bytes = 0, bodies = 0;
  std::uint64_t hash = 0;
  for (auto _ : bench) {
    const std::unique_ptr<Crowd> crowd = make();
    bodies = crowd->layout().capacity;
    auto client = *ClientTimeline::create(crowd->layout());
    client.set_clock(now_ns);
    std::vector<std::byte> snapshot;
    crowd->snapshot(snapshot);
    if (!client.load(snapshot, 1)) bench.SkipWithError("snapshot refused");
    for (int i = 0; i < warm + kMeasured; ++i) {
      const auto frame = crowd->advance();
      client.step(1);
      if (!client.apply(frame.frame, 0, frame.hash, frame.payload)) bench.SkipWithError("delta refused");
      if (i < warm) continue;
      encode_ns.push_back(static_cast<double>(frame.encode_ns) / frame.corrected);
      decode_ns.push_back(static_cast<double>(client.timings().decode_ns) / frame.corrected);
      corrected += frame.corrected;
      bytes += static_cast<double>(frame.payload.size());
    }
    hash = client.hash();
  }
  bench.counters["encode_ns"] = median(encode_ns);
  bench.counters["decode_ns"] = median(decode_ns);
  bench.counters["corrected_percent"] = 100 * corrected / static_cast<double>(encode_ns.size()) / bodies;
  bench.counters["bits"] = 8 * bytes / corrected;
  bench.SetLabel("hash " + std::to_string(hash));
}

const bool kRegistered = [] {
  const auto add = [](const char* name, int warm, const auto& make) {
    benchmark::RegisterBenchmark((std::string("tracker_crowd/") + name).c_str(),
                                 [=](benchmark::State& bench) { tracker_crowd(bench, make, warm); })
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  };
  const auto pushed = [](std::uint32_t bodies, std::uint64_t one_in, const Groups& groups) {
    return [=] { return std::unique_ptr<Crowd>(std::make_unique<PushedCrowd>(bodies, one_in, groups)); };
  };
  const auto falling = [](double share) {
    return [=] { return std::unique_ptr<Crowd>(std::make_unique<FallingCrowd>(share)); };
  };
  add("falling", 40, falling(1));
  add("falling_finely", 40, falling(0.1));
  add("a_twentieth", 20, pushed(kBodies, 20, {}));
  add("turning", 20, pushed(2 * kBlockSlots, 3, synthetic::kTurning));
  return true;
}();

}  // namespace
}  // namespace tandem
