#include "services/lab/measures/client_cost.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/lab/measures/scene_source.hpp"

namespace tandem::lab {
namespace {

constexpr std::int64_t kWallOffsetNs = 1'700'000'000'000'000'000;
constexpr std::uint64_t kWarmUpFrames = 60;
constexpr std::uint64_t kBesideFrames = 120;
constexpr int kTicksAFrame = 16;
constexpr double kSampleHz = 144;
constexpr std::int64_t kStartNs = 60'000'000'000;

class Costs {
 public:
  void add(std::int64_t ns) { ns_.push_back(ns); }
  [[nodiscard]] Cost quantiles() {
    std::sort(ns_.begin(), ns_.end());
    const auto at = [this](double q) {
      if (ns_.empty()) return 0.0;
      return static_cast<double>(ns_[static_cast<std::size_t>(q * static_cast<double>(ns_.size() - 1))]) /
             1e6;
    };
    return {at(0.5), at(0.99), at(0.999)};
  }

 private:
  std::vector<std::int64_t> ns_;
};

/// Counts the bodies that deltas corrected.
class Corrections final : public client::CoreListener {
 public:
  void on_applied(Epoch /*epoch*/, const client::CompleteDelta& /*delta*/) override {
    corrected += core->timeline()->corrected().size();
  }
  const client::ClientCore* core = nullptr;
  std::uint64_t corrected = 0;
};

class MeasuredClient {
 public:
  MeasuredClient(std::unique_ptr<transport::ClientPort> port, const client::CoreOptions& options)
      : port_(std::move(port)), core_(options, *port_, &corrections_) {
    corrections_.core = &core_;
  }
  client::ClientCore& core() { return core_; }

  /// `counts`: add the measured time to the result.
  void poll(const client::Now& now, bool counts) {
    const std::uint64_t applied = core_.statistics().frames_applied;
    const Frame simulated = now_simulated();
    const std::int64_t began_ns = thread_cpu_ns();
    core_.poll(now);
    const std::int64_t took_ns = thread_cpu_ns() - began_ns;
    frame_ns_ += took_ns;
    if (core_.statistics().frames_applied == applied) {
      if (now_simulated() != simulated) step_ns_ += took_ns;
      return;
    }
    if (counts) {
      frame.add(frame_ns_);
      if (step_ns_ > 0) predicted.add(step_ns_);
    } else {
      corrections_.corrected = 0;
    }
    frame_ns_ = step_ns_ = 0;
  }
  [[nodiscard]] std::uint64_t corrected() const { return corrections_.corrected; }

  Costs frame, predicted;

 private:
  [[nodiscard]] Frame now_simulated() const {
    return core_.timeline() != nullptr ? core_.timeline()->now() : 0;
  }
  std::unique_ptr<transport::ClientPort> port_;
  Corrections corrections_;
  client::ClientCore core_;
  std::int64_t frame_ns_ = 0, step_ns_ = 0;
};

/// Arrays as an application has them.
class Arrays {
 public:
  explicit Arrays(std::size_t slots)
      : positions_(3 * slots), velocities_(3 * slots), types_(slots), alive_(slots) {
    columns_.capacity = slots;
    columns_.positions = client::packed(positions_.data(), 3);
    columns_.velocities = client::packed(velocities_.data(), 3);
    columns_.types = client::packed(types_.data());
    columns_.alive = client::packed(alive_.data());
  }
  [[nodiscard]] const client::SampleColumns& columns() const { return columns_; }

 private:
  std::vector<float> positions_, velocities_;
  std::vector<std::uint16_t> types_;
  std::vector<std::uint8_t> alive_;
  client::SampleColumns columns_;
};

}  // namespace

std::int64_t thread_cpu_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

Result<ClientCostRow> measure_client_cost(const scenes::Scene& scene, const ClientCostSetup& setup) {
  auto source = make_source(
      scene, {.bodies = setup.choice.bodies, .seed = setup.seed, .frames = kWarmUpFrames + setup.frames});
  if (!source) return tl::unexpected(source.error());
  engine::Simulation& simulation = *source->simulation;
  auto config = sessions::plan_session(scene, setup.choice);
  if (!config) return tl::unexpected(config.error());
  config->streams[0].layout.lead = 1;
  config->wait_for = 2;
  config->clock_ns = &thread_cpu_ns;
  ClientCostRow row{.scene = scene.name,
                    .predictor = config->streams[0].layout.predictor,
                    .codec = config->streams[0].layout.codec,
                    .bodies = setup.choice.bodies,
                    .frames = setup.frames};

  transport::simulated::Network network({.seed = setup.seed, .link = {}});
  auto server_port = network.make_server(config->session);
  if (!server_port) return tl::unexpected(server_port.error());
  client::CoreOptions options;
  options.session = config->session;
  std::array<std::unique_ptr<MeasuredClient>, 2> clients;
  for (auto& client : clients) {
    auto port = network.make_client(config->session);
    if (!port) return tl::unexpected(port.error());
    ++options.id;
    client = std::make_unique<MeasuredClient>(std::move(*port), options);
  }
  MeasuredClient& unsampled = *clients[0];
  MeasuredClient& sampled = *clients[1];
  sampled.core().start_sampling();
  const double period_ns = simulation.dt_s() * 1e9;
  auto created = host::Host::create(std::move(*config), simulation, **server_port);
  if (!created) return tl::unexpected(created.error());
  host::Host& host = **created;

  Arrays arrays(simulation.capacity());
  Costs engine, sample;
  std::size_t next_input = 0;
  std::int64_t tick = 0;
  const auto played = [&] {
    return std::min(unsampled.core().statistics().frames_applied, sampled.core().statistics().frames_applied);
  };
  const auto clock = [&](std::int64_t ticks) {
    return std::llround(static_cast<double>(ticks) * period_ns / kTicksAFrame);
  };
  std::atomic<std::int64_t> session_ns = 0;
  // A tick of server and network; of the clients when `counts` or not.
  const auto go_on = [&](bool counts) -> Result<client::Now> {
    const client::Now now{clock(++tick), clock(tick) + kWallOffsetNs};
    if (played() == 0 && now.steady_ns > kStartNs)
      return fail(ErrorCode::kTimeout, "the clients never played");
    network.advance_to(now.steady_ns);
    for (; next_input < source->script.size() && source->script[next_input].frame <= host.frame() + 2;
         ++next_input) {
      static_cast<void>(host.inject(source->script[next_input].input));
    }
    if (host.poll(now.steady_ns, now.wall_ns) && counts)
      engine.add(std::llround(host.report().step_ms * 1e6));
    if (auto drained = host::drain(host.outbox(), **server_port); !drained)
      return tl::unexpected(drained.error());
    static_cast<void>(host.take_notices());
    for (auto& client : clients) client->poll(now, counts);
    session_ns = now.steady_ns;
    return now;
  };

  double next_sample_ns = 0;
  while (played() < kWarmUpFrames + setup.frames) {
    const bool counts = played() >= kWarmUpFrames;
    const auto now = go_on(counts);
    if (!now) return tl::unexpected(now.error());
    if (static_cast<double>(now->steady_ns) < next_sample_ns) continue;
    next_sample_ns = static_cast<double>(now->steady_ns) + 1e9 / kSampleHz;
    const std::int64_t began_ns = thread_cpu_ns();
    const auto taken = sampled.core().sample({}, arrays.columns(), *now);
    if (counts && taken) sample.add(thread_cpu_ns() - began_ns);
  }
  row.engine = engine.quantiles();
  row.frame = unsampled.frame.quantiles();
  row.predicted = unsampled.predicted.quantiles();
  row.sampled_frame = sampled.frame.quantiles();
  row.sample = sample.quantiles();
  row.corrected_per_frame = static_cast<double>(unsampled.corrected()) / static_cast<double>(setup.frames);

  Costs beside;
  std::atomic<bool> ending = false;
  std::thread app([&] {
    Arrays own(simulation.capacity());
    while (!ending) {
      const client::Now now{session_ns, 0};
      const std::int64_t began_ns = steady_ns();
      const auto taken = sampled.core().sample({}, own.columns(), now);
      if (taken) beside.add(steady_ns() - began_ns);
      std::this_thread::yield();
    }
  });
  Result<client::Now> now = client::Now{};
  while (now && played() < kWarmUpFrames + setup.frames + kBesideFrames) now = go_on(false);
  ending = true;
  app.join();
  if (!now) return tl::unexpected(now.error());
  row.beside = beside.quantiles();
  return row;
}

}  // namespace tandem::lab
