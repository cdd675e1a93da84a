// Clients of a world that rests most of the time, over random links: they join while it rests, see what wakes
// at once, and nobody joins again.
//   TANDEM_FAULT_SEED=N    replays one
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "tandem/simulation.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::client::of_rest {
namespace {

using transport::simulated::LinkModel;

constexpr std::int64_t kTickNs = 2'000'000, kWallNs = 1'700'000'000'000'000'000;
constexpr double kThreshold = 0.05;
constexpr std::uint32_t kBodies = 50;

/// Bodies that stand, and all move while `awake`.
class Sleepers final : public engine::Simulation {
 public:
  Sleepers() {
    for (auto& column : position_) column.assign(kBodies, 0.0F);
    for (auto& column : velocity_) column.assign(kBodies, 0.0F);
    for (std::uint32_t body = 0; body < kBodies; ++body) position_[0][body] = static_cast<float>(body);
  }
  [[nodiscard]] std::uint32_t capacity() const override { return kBodies; }
  [[nodiscard]] double dt_s() const override { return 1.0 / 30; }
  [[nodiscard]] engine::Vec3 gravity() const override { return {}; }
  [[nodiscard]] double damping_per_s() const override { return 0; }
  [[nodiscard]] engine::Classification classify(const engine::Input& /*input*/) const override { return {}; }
  void apply(const engine::Input& /*input*/) override {}
  void step() override {
    if (!awake) return;
    for (std::uint32_t body = 0; body < kBodies; ++body)
      position_[1][body] += std::sin(static_cast<float>(++steps_ + body));
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    return {.position = {position_[0], position_[1], position_[2]},
            .velocity = {velocity_[0], velocity_[1], velocity_[2]},
            .alive = alive_,
            .type = type_};
  }
  [[nodiscard]] std::span<const engine::Event> events() const override { return {}; }
  [[nodiscard]] std::uint32_t colliding() const override { return 0; }
  void save(std::vector<std::byte>& out) const override { out.clear(); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override { return bytes.empty(); }

  bool awake = true;

 private:
  std::array<std::vector<float>, 3> position_, velocity_;
  std::vector<std::uint8_t> alive_ = std::vector<std::uint8_t>(kBodies, 1);
  std::vector<std::uint16_t> type_ = std::vector<std::uint16_t>(kBodies, 0);
  std::uint64_t steps_ = 0;
};

class World {
 public:
  World(std::uint64_t seed, const LinkModel& link) : network_({.seed = seed, .link = link}) {
    network_.advance_to(now_ns_);
    server_port_ = std::move(*network_.make_server("default"));
    host::HostConfig config;
    config.epoch = 1000;
    config.streams.resize(1);
    host::StreamConfig& stream = config.streams[0];
    stream.lattice = *host::choose_lattice(kThreshold, 3, engine_.dt_s());
    stream.layout.lead = 1;
    stream.layout.capacity = kBodies;
    stream.layout.codec = "tracker";
    stream.layout.parameters.codec = *host::codec_parameters(stream.lattice, kThreshold, 0.1, 2);
    config.types = {{"ball", 0.1F, 0xFFFFFFFF}};
    host_ = std::move(*host::Host::create(std::move(config), engine_, *server_port_));
  }

  ClientCore& join(transport::ClientId id, transport::Role role) {
    Member& member = members_.emplace_back();
    member.port = std::move(*network_.make_client("default"));
    CoreOptions options;
    options.session = "default";
    options.id = id;
    options.role = role;
    member.core = std::make_unique<ClientCore>(std::move(options), *member.port, nullptr);
    return *member.core;
  }
  void run(double seconds) {
    for (const std::int64_t end_ns = now_ns_ + std::llround(seconds * 1e9); now_ns_ < end_ns;) {
      now_ns_ += kTickNs;
      network_.advance_to(now_ns_);
      host_->poll(now_ns_, now_ns_ + kWallNs);
      if (!host::drain(host_->outbox(), *server_port_)) ADD_FAILURE() << "a write was refused";
      for (Member& member : members_) member.core->poll({now_ns_, now_ns_ + kWallNs});
    }
  }
  void check(const char* when) const {
    for (const Member& member : members_) {
      EXPECT_EQ(member.core->phase(), ClientPhase::kPlaying) << when;
      EXPECT_EQ(member.core->statistics().resyncs, 0U) << when;
      EXPECT_EQ(member.core->statistics().hash_mismatches, 0U) << when;
    }
    EXPECT_EQ(host_->totals().stalls, stalls_) << when;
    EXPECT_EQ(host_->totals().demotions, 0U) << when;
  }
  /// Loss may make the server wait while bodies move: check() counts what comes after this.
  void excuse_stalls() { stalls_ = host_->totals().stalls; }
  /// How many frames the client that is furthest behind lacks.
  [[nodiscard]] Frame behind() const {
    Frame most = 0;
    for (const Member& member : members_)
      most = std::max(most, host_->frame() - member.core->timeline()->applied());
    return most;
  }
  Sleepers& engine() { return engine_; }

 private:
  struct Member {
    std::unique_ptr<transport::ClientPort> port;
    std::unique_ptr<ClientCore> core;
  };
  std::uint64_t stalls_ = 0;
  std::int64_t now_ns_ = 1'000'000'000;
  Sleepers engine_;
  transport::simulated::Network network_;
  std::unique_ptr<transport::ServerPort> server_port_;
  std::unique_ptr<host::Host> host_;
  std::vector<Member> members_;
};

TEST(Rest, ClientsJoinAndWakeWithoutAnyNoticingTheQuietFrames) {
  const char* const replay = std::getenv("TANDEM_FAULT_SEED");
  const std::uint64_t first = replay != nullptr ? std::strtoull(replay, nullptr, 10) : 1;
  for (std::uint64_t seed = first; seed < first + (replay != nullptr ? 1 : 15); ++seed) {
    SCOPED_TRACE("TANDEM_FAULT_SEED=" + std::to_string(seed));
    Dice dice(seed);
    LinkModel link;
    link.delay_ns = static_cast<std::int64_t>(dice.uniform(0, 60e6));
    link.jitter_ns = static_cast<std::int64_t>(dice.uniform(0, 30e6));
    link.loss = dice.chance(0.5) ? dice.uniform(0, 0.05) : 0;
    World world(seed, link);
    world.run(1);
    world.join(100, transport::Role::kParticipant);
    world.run(3);
    world.engine().awake = false;
    world.run(10);  // until not even ages change
    world.excuse_stalls();
    world.run(3);
    Frame most = 0;
    for (int i = 0; i < 10; ++i) {
      world.run(0.1);
      most = std::max(most, world.behind());
    }
    EXPECT_GT(most, 15U) << "a delta a second";
    world.run(dice.uniform(0, 1.5));
    world.join(101, transport::Role::kParticipant);
    world.join(102, transport::Role::kObserver);
    world.run(5);
    world.check("at rest");
    EXPECT_LE(world.behind(), 30U + 30) << "a second, and the way";
    world.engine().awake = true;
    world.run(1);
    world.excuse_stalls();
    world.check("awake");
    EXPECT_LE(world.behind(), 12U) << "as on any frame";
    world.engine().awake = false;
    world.run(10);
    world.excuse_stalls();
    world.run(3 + dice.uniform(0, 1));
    world.check("at rest again");
  }
}

}  // namespace
}  // namespace tandem::client::of_rest
