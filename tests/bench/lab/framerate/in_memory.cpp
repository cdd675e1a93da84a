// Update rates without a network of one's own: see play_in_memory().

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "sdk/wire/units.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "tests/bench/lab/framerate/framerate.hpp"

namespace tandem::lab {
namespace {

using transport::simulated::Bottleneck;

constexpr std::int64_t kTickNs = 100'000;
constexpr std::int64_t kWallOffsetNs = 1'700'000'000'000'000'000;
constexpr std::uint64_t kMaxFrames = 1'000'000;
// Maximum simulated time until all clients play.
constexpr std::int64_t kStartNs = 60'000'000'000;

/// Runs `work` unless an earlier one still keeps this processor busy.
class Processor {
 public:
  explicit Processor(double slowdown) : slowdown_(slowdown) {}
  template <class Work>
  void run(std::int64_t now_ns, Work&& work) {
    if (now_ns < free_ns_) return;
    const std::int64_t began_ns = steady_ns();
    work();
    free_ns_ = now_ns + std::llround(static_cast<double>(steady_ns() - began_ns) * slowdown_);
  }

 private:
  double slowdown_;
  std::int64_t free_ns_ = 0;
};

struct User {
  std::unique_ptr<transport::ClientPort> port;
  std::unique_ptr<client::ClientCore> core;
  Processor processor;
};

Result<host::HostConfig> plan(const scenes::Scene& scene, const FramerateRow& row) {
  sessions::SessionChoice choice;
  choice.bodies = row.bodies;
  if (row.method == kBallistic || row.method == kField) {
    choice.predictor = row.method;
  } else if (row.method != kAsItComes) {
    choice.codec = row.method;
  }
  return sessions::plan_session(scene, choice).map([&](host::HostConfig&& config) {
    config.streams[0].layout.lead = 1;
    config.window = 2;
    config.free_rate = true;
    config.stall_timeout_ns.reset();
    config.wait_for = row.users;
    config.clock_ns = &steady_ns;
    return config;
  });
}

Result<User> make_user(transport::simulated::Network& network, const host::HostConfig& config,
                       transport::ClientId id, double slowdown) {
  auto port = network.make_client(config.session);
  if (!port) return tl::unexpected(port.error());
  client::CoreOptions options;
  options.session = config.session;
  options.id = id;
  options.measure_ns = &steady_ns;
  auto core = std::make_unique<client::ClientCore>(options, **port);
  return User{std::move(*port), std::move(core), Processor(slowdown)};
}

}  // namespace

Result<void> play_in_memory(const FramerateSetup& setup, FramerateRow& row) {
  const auto scene = scenes::load_scene(row.scene);
  if (!scene) return tl::unexpected(scene.error());
  SceneRun run{.bodies = row.bodies, .seed = setup.seed, .users = row.users, .frames = kMaxFrames};
  auto source = make_source(*scene, run);
  if (!source) return tl::unexpected(source.error());
  auto config = plan(*scene, row);
  if (!config) return tl::unexpected(config.error());

  transport::simulated::Network network({});
  auto server_port = network.make_server(config->session);
  if (!server_port) return tl::unexpected(server_port.error());
  const auto down = std::make_shared<Bottleneck>(setup.link);
  const auto up = std::make_shared<Bottleneck>(setup.link);
  std::vector<User> users;
  for (std::uint32_t i = 0; i < row.users; ++i) {
    auto user = make_user(network, *config, i + 1, i == 0 ? setup.slowdown : 1);
    if (!user) return tl::unexpected(user.error());
    users.push_back(std::move(*user));
    const transport::ParticipantId own = users.back().port->self();
    network.set_link((*server_port)->self(), own, {.delay_ns = 0, .bottleneck = down});
    network.set_link(own, (*server_port)->self(), {.delay_ns = 0, .bottleneck = up});
  }
  auto created = host::Host::create(std::move(*config), *source->simulation, **server_port);
  if (!created) return tl::unexpected(created.error());
  host::Host& host = **created;

  Processor server(1);
  const client::Statistics& seen = users[0].core->statistics();
  std::size_t next_input = 0;
  std::optional<std::int64_t> first_ns;
  const auto lasts_ns = static_cast<std::int64_t>(setup.seconds * 1e9);
  for (std::int64_t now_ns = kTickNs; !first_ns || now_ns - *first_ns < lasts_ns; now_ns += kTickNs) {
    if (!first_ns && now_ns > kStartNs) return fail(ErrorCode::kTimeout, "nobody played");
    if (*setup.stop) return fail(ErrorCode::kIo, "stopped");
    network.advance_to(now_ns);
    Result<void> drained;
    server.run(now_ns, [&] {
      for (; next_input < source->script.size() && source->script[next_input].frame <= host.frame() + 2;
           ++next_input) {
        static_cast<void>(host.inject(source->script[next_input].input));
      }
      host.poll(now_ns, now_ns + kWallOffsetNs);
      drained = host::drain(host.outbox(), **server_port);
      static_cast<void>(host.take_notices());
    });
    if (!drained) return drained;
    for (User& user : users) {
      user.processor.run(now_ns, [&] { user.core->poll({now_ns, now_ns + kWallOffsetNs}); });
    }
    if (!first_ns && seen.frames_applied > 0) first_ns = now_ns;
  }
  row.updates_per_s = static_cast<double>(seen.frames_applied) / setup.seconds;
  row.client_ms_p50 = seen.frame_cost.quantile_ms(0.5) * setup.slowdown;
  row.latency_ms_p50 = seen.latency.quantile_ms(0.5);
  row.resyncs = seen.resyncs;
  row.link_mbit_per_s = static_cast<double>(down->bytes()) * 8 / kBitsPerMbit / setup.seconds;
  row.dropped = down->dropped() + up->dropped();
  row.stream = users[0].core->status().stream;
  return {};
}

}  // namespace tandem::lab
