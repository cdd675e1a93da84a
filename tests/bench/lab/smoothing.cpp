#include "tests/bench/lab/smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/lab/measures/scene_source.hpp"

namespace tandem::lab {
namespace {

constexpr std::int64_t kWallOffsetNs = 1'700'000'000'000'000'000;
constexpr int kTicksASample = 8;
constexpr double kStartS = 30;
constexpr double kOutageEveryS = 5;
constexpr std::size_t kFramesKept = 512;

using Place = std::array<double, 3>;

double length(const Place& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// Counts lengths in steps of 1 %.
class Lengths {
 public:
  void add(double value) {
    const double step = std::log(std::max(value, kLeast) / kLeast) / kStep;
    ++counts_[std::min(counts_.size() - 1, static_cast<std::size_t>(step))];
    ++count_;
    sum_ += value;
  }
  [[nodiscard]] double mean() const { return count_ == 0 ? 0 : sum_ / static_cast<double>(count_); }
  /// The quantile `q` of the lengths.
  [[nodiscard]] double quantile(double q) const {
    auto left = static_cast<std::uint64_t>(q * static_cast<double>(count_));
    for (std::size_t step = 0; step < counts_.size(); ++step) {
      if (counts_[step] > left) return step == 0 ? 0 : kLeast * std::exp(kStep * static_cast<double>(step));
      left -= counts_[step];
    }
    return 0;
  }

 private:
  static constexpr double kLeast = 1e-9;
  static constexpr double kStep = 0.01;
  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(3000);
  std::uint64_t count_ = 0;
  double sum_ = 0;
};

/// The places of the bodies in the full simulation.
class Truth {
 public:
  void add(Frame frame, const engine::Bodies& bodies) {
    std::vector<Place> places(bodies.alive.size());
    for (std::size_t body = 0; body < places.size(); ++body) {
      for (std::size_t axis = 0; axis < 3; ++axis) places[body][axis] = bodies.position[axis][body];
    }
    if (frames_.empty()) first_ = frame;
    frames_.push_back(std::move(places));
    if (frames_.size() <= kFramesKept) return;
    frames_.pop_front();
    ++first_;
  }
  /// Whether the moment is past.
  [[nodiscard]] bool knows(double frame) const {
    return !frames_.empty() && frame <= static_cast<double>(first_ + frames_.size() - 1);
  }
  [[nodiscard]] Place at(double frame, std::size_t body) const {
    const double since = std::max(0.0, frame - static_cast<double>(first_));
    const auto before = std::min(static_cast<std::size_t>(since), frames_.size() - 1);
    const auto after = std::min(before + 1, frames_.size() - 1);
    const double share = since - static_cast<double>(before);
    Place place{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double from = frames_[before][body][axis];
      place[axis] = from + (frames_[after][body][axis] - from) * share;
    }
    return place;
  }

 private:
  Frame first_ = 0;
  std::deque<std::vector<Place>> frames_;
};

/// One of the two clients, and what it showed.
class Watcher {
 public:
  Watcher(std::unique_ptr<transport::ClientPort> port, const client::CoreOptions& options, double smoothing_s)
      : port_(std::move(port)), core_(options, *port_), request_{.smoothing_s = smoothing_s} {
    core_.start_sampling();
  }
  [[nodiscard]] transport::ParticipantId self() const { return port_->self(); }
  [[nodiscard]] const client::ClientCore& core() const { return core_; }
  void poll(const client::Now& now) { core_.poll(now); }

  void sample(const client::Now& now) {
    const auto drawable = core_.drawable();
    if (!drawable) return;
    Shown shown{.frame = 0,
                .places = std::vector<float>(std::size_t{3} * drawable->capacity),
                .steady = std::vector<std::uint8_t>(drawable->capacity)};
    alive_.resize(drawable->capacity);
    client::SampleColumns columns{.capacity = drawable->capacity};
    columns.positions = client::packed(shown.places.data(), 3);
    columns.changes = client::packed(shown.steady.data());
    columns.alive = client::packed(alive_.data());
    const auto sampled = core_.sample(request_, columns, now);
    if (!sampled) return;
    shown.frame = sampled->frame;
    for (std::size_t body = 0; body < alive_.size(); ++body)
      shown.steady[body] = alive_[body] != 0 && shown.steady[body] == 0 ? 1 : 0;
    shown_.push_back(std::move(shown));
  }
  /// Compares the moments that are past.
  void compare(const Truth& truth, bool counts) {
    while (shown_.size() >= 3 && truth.knows(shown_[2].frame)) {
      if (counts) compare_first(truth);
      shown_.pop_front();
    }
  }
  [[nodiscard]] Seen seen() const {
    return {jumps_.quantile(0.999), errors_.mean(), errors_.quantile(0.999)};
  }
  [[nodiscard]] std::uint64_t samples() const { return samples_; }

 private:
  struct Shown {
    double frame = 0;
    std::vector<float> places;
    std::vector<std::uint8_t> steady;  // the body was there before, and did not jump
  };

  void compare_first(const Truth& truth) {
    ++samples_;
    for (std::size_t body = 0; body < alive_.size(); ++body) {
      if (shown_[1].steady[body] == 0 || shown_[2].steady[body] == 0 || shown_[0].steady[body] == 0) continue;
      const std::array<Place, 3> truths{truth.at(shown_[0].frame, body), truth.at(shown_[1].frame, body),
                                        truth.at(shown_[2].frame, body)};
      Place error{}, bend{}, true_bend{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto place = [&](std::size_t i) { return double{shown_[i].places[3 * body + axis]}; };
        error[axis] = place(2) - truths[2][axis];
        bend[axis] = place(2) - 2 * place(1) + place(0);
        true_bend[axis] = truths[2][axis] - 2 * truths[1][axis] + truths[0][axis];
      }
      errors_.add(length(error));
      jumps_.add(std::max(0.0, length(bend) - length(true_bend)));
    }
  }

  std::unique_ptr<transport::ClientPort> port_;
  client::ClientCore core_;
  client::SampleRequest request_;
  std::deque<Shown> shown_;
  std::vector<std::uint8_t> alive_;
  Lengths errors_, jumps_;
  std::uint64_t samples_ = 0;
};

}  // namespace

Result<SmoothingRow> measure_smoothing(const scenes::Scene& scene, const SmoothingSetup& setup) {
  constexpr std::uint64_t kMaxFrames = 1'000'000;
  auto source = make_source(scene, {.bodies = setup.choice.bodies, .seed = setup.seed, .frames = kMaxFrames});
  if (!source) return tl::unexpected(source.error());
  auto config = sessions::plan_session(scene, setup.choice);
  if (!config) return tl::unexpected(config.error());
  config->streams[0].layout.lead = 1;
  SmoothingRow row{
      .scene = scene.name,
      .predictor = config->streams[0].layout.predictor,
      .codec = config->streams[0].layout.codec,
      .bodies = setup.choice.bodies,
      .threshold = setup.choice.threshold_m.value_or(scene.threshold_m) * setup.choice.threshold_scale};

  transport::simulated::Network network({.seed = setup.seed,
                                         .link = {.delay_ns = std::llround(setup.delay_ms * 1e6),
                                                  .jitter_ns = std::llround(setup.jitter_ms * 1e6)}});
  auto server_port = network.make_server(config->session, 1024);
  if (!server_port) return tl::unexpected(server_port.error());
  client::CoreOptions options;
  options.session = config->session;
  // An observer sees an outage as it is, because the server does not wait for it.
  options.role = setup.outage_s > 0 ? transport::Role::kObserver : transport::Role::kParticipant;
  config->wait_for = setup.outage_s > 0 ? 0 : 2;
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (const double smoothing_s : {setup.smoothing_s, 0.0}) {
    auto port = network.make_client(config->session, 1024);
    if (!port) return tl::unexpected(port.error());
    options.id = watchers.size() + 1;
    watchers.push_back(std::make_unique<Watcher>(std::move(*port), options, smoothing_s));
  }
  auto created = host::Host::create(std::move(*config), *source->simulation, **server_port);
  if (!created) return tl::unexpected(created.error());
  host::Host& host = **created;

  Truth truth;
  std::size_t next_input = 0;
  std::optional<std::int64_t> first_ns;
  std::int64_t now_ns = 0;
  const auto since_s = [&] { return first_ns ? static_cast<double>(now_ns - *first_ns) / 1e9 : 0; };
  for (std::int64_t tick = 1; since_s() < setup.seconds + 1; ++tick) {
    now_ns = std::llround(static_cast<double>(tick) * 1e9 / (setup.rate_hz * kTicksASample));
    if (!first_ns && now_ns > static_cast<std::int64_t>(kStartS * 1e9))
      return fail(ErrorCode::kTimeout, "the clients never played");
    network.advance_to(now_ns);
    for (; next_input < source->script.size() && source->script[next_input].frame <= host.frame() + 2;
         ++next_input) {
      static_cast<void>(host.inject(source->script[next_input].input));
    }
    const client::Now now{now_ns, now_ns + kWallOffsetNs};
    if (host.poll(now.steady_ns, now.wall_ns)) truth.add(host.frame(), source->simulation->bodies());
    if (auto drained = host::drain(host.outbox(), **server_port); !drained)
      return tl::unexpected(drained.error());
    static_cast<void>(host.take_notices());
    const bool cut = setup.outage_s > 0 &&
                     std::fmod(since_s() + kOutageEveryS - 1, kOutageEveryS) < setup.outage_s && first_ns;
    for (auto& watcher : watchers) {
      network.set_cut((*server_port)->self(), watcher->self(), cut);
      watcher->poll(now);
      if (tick % kTicksASample != 0) continue;
      watcher->sample(now);
      watcher->compare(truth, since_s() > 1);
    }
    const bool playing = std::all_of(watchers.begin(), watchers.end(), [](const auto& watcher) {
      return watcher->core().statistics().frames_applied > 0;
    });
    if (!first_ns && playing) first_ns = now_ns;
  }
  row.samples = watchers[0]->samples();
  row.smoothed = watchers[0]->seen();
  row.unsmoothed = watchers[1]->seen();
  return row;
}

}  // namespace tandem::lab
