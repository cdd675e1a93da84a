// A server that measures what its streams would cost: clients follow to the cheaper one, without a gap, and
// nothing changes where it does not pay.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/follow/following/session_client.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/planning/plan.hpp"

namespace tandem::client {
namespace {

constexpr std::int64_t kTickNs = 4'000'000;
constexpr std::int64_t kWallNs = 1'700'000'000'000'000'000;
constexpr std::uint32_t kBodies = 150;
constexpr double kRadius = 0.5, kHalf = 2.5;

planning::PlannedWorld room() {
  planning::PlannedWorld world;
  world.name = "room";
  world.capacity = kBodies;
  world.dt_s = 1.0 / 30;
  world.extent = 60;
  world.threshold = 0.05;
  world.types = {{.name = "ball", .bounding_radius = kRadius, .contact_radius = kRadius}};
  Scenery scenery;
  scenery.between_bodies = scenery.with_scenery = {.spring = 400, .damping = 3, .shear = 0.3};
  scenery.planes = {
      {{0, 1, 0}, 0}, {{1, 0, 0}, -kHalf}, {{-1, 0, 0}, -kHalf}, {{0, 0, 1}, -kHalf}, {{0, 0, -1}, -kHalf}};
  world.scenery = scenery;
  return world;
}

/// An engine whose bodies move as one of the predictors has it. Every third of a second a part of the heap is
/// thrown up, so that it never comes to rest.
class Heap final : public engine::Simulation {
 public:
  explicit Heap(const host::StreamConfig& like)
      : lattice_(like.lattice),
        unit_(like.lattice.unit),
        predictor_(*make_predictor(like.layout.predictor, kBodies, like.layout.predictor_constants)),
        state_(kBodies),
        alive_(kBodies, 1),
        type_(kBodies, 0) {
    state_.keep_for_predictor(predictor_->own_bytes());
    input_.drive = drive_ = *host::to_drive(like.lattice, gravity(), 0);
    input_.parameters.contacts = like.layout.parameters.step.contacts;
    input_.threshold = like.layout.parameters.codec.threshold;
    for (std::uint32_t body = 0; body < kBodies; ++body) {
      const std::uint32_t place = body % 16;
      const double jitter = 0.03 * (body % 7);
      BodyState start;
      start.p = {units(-1.8 + 1.2 * (place % 4) + jitter), units(0.7 + 1.2 * (body / 16)),
                 units(-1.8 + 1.2 * (place / 4) - jitter)};
      state_.spawn(body, 0, 0, start);
    }
    show();
  }

  [[nodiscard]] std::uint32_t capacity() const override { return kBodies; }
  [[nodiscard]] double dt_s() const override { return 1.0 / 30; }
  [[nodiscard]] engine::Vec3 gravity() const override { return {0, -9.81, 0}; }
  [[nodiscard]] double damping_per_s() const override { return 0; }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    engine::Classification effect;
    if (input.values.size() != 3) return effect;
    effect.effect = engine::Classification::Effect::kScheduled;
    effect.gravity = {input.values[0], input.values[1], input.values[2]};
    return effect;
  }
  void apply(const engine::Input& input) override {
    drive_ = *host::to_drive(lattice_, {input.values[0], input.values[1], input.values[2]}, 0);
  }
  void step() override {
    if (++steps_ % 10 == 0) {
      for (std::uint32_t body = static_cast<std::uint32_t>(steps_ / 10) % 5; body < kBodies; body += 5)
        state_.v(1)[body] += units(64 * 4.0 / 30);
    }
    input_.gravity_before = std::exchange(input_.drive, drive_).gravity;
    predictor_->step(state_, state_, input_);
    show();
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
  [[nodiscard]] bool load(std::span<const std::byte> /*bytes*/) override { return false; }

 private:
  [[nodiscard]] std::int32_t units(double m) const {
    return static_cast<std::int32_t>(std::lround(m / unit_));
  }
  void show() {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position_[axis].resize(kBodies);
      velocity_[axis].resize(kBodies);
      for (std::uint32_t body = 0; body < kBodies; ++body) {
        position_[axis][body] = static_cast<float>(state_.p(axis)[body] * unit_);
        velocity_[axis][body] = static_cast<float>(state_.v(axis)[body] / 64.0 * unit_ * 30);
      }
    }
  }
  host::Lattice lattice_;
  double unit_;
  Drive drive_;
  std::unique_ptr<Predictor> predictor_;
  State state_;
  StepInput input_;
  std::uint64_t steps_ = 0;
  std::array<std::vector<float>, 3> position_, velocity_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint16_t> type_;
};

/// A client that checks that it hears each frame once, in order, with the server's hash.
class Listening final : public CoreListener {
 public:
  Listening(transport::simulated::Network& network, std::string prefer)
      : port(std::move(*network.make_client("default"))) {
    CoreOptions options;
    options.session = "default";
    options.id = 100;
    options.prefer = std::move(prefer);
    core = std::make_unique<ClientCore>(std::move(options), *port, this);
  }
  void on_stream(const transport::StreamMessage& stream) override {
    if (played.empty() || played.back() != stream.name) played.push_back(stream.name);
    if (core->timeline() != nullptr) last = core->timeline()->applied();
  }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    ++snapshots;
    last = snapshot.frame;
  }
  void on_applied(Epoch /*epoch*/, const CompleteDelta& delta) override {
    EXPECT_EQ(delta.frame, last + 1);
    last = delta.frame;
    ASSERT_NE(core->timeline(), nullptr);
    EXPECT_EQ(core->timeline()->hash(), delta.hash);
  }

  std::unique_ptr<transport::ClientPort> port;
  std::unique_ptr<ClientCore> core;
  std::vector<std::string> played;
  std::size_t snapshots = 0;
  Frame last = 0;
};

class TrialsTest : public ::testing::Test {
 protected:
  /// An engine whose bodies move as that predictor has it in a room; the server is told of `world`.
  void start(const std::string& engine, const planning::PlannedWorld& world = room()) {
    network.advance_to(now_ns);
    server_port = std::move(*network.make_server("default"));
    planning::ServiceWishes service;
    service.stall_timeout_s.reset();
    auto config = planning::plan_server(world, {}, service);
    ASSERT_TRUE(config) << config.error().message;
    const auto engines = planning::plan_server(room(), {}, service);
    ASSERT_TRUE(engines);
    config->epoch = 1000;
    config->clock_ns = nullptr;
    ASSERT_EQ(config->streams.size(), 6U) << "each in two delays";
    const auto like = std::ranges::find_if(engines->streams, [&](const host::StreamConfig& stream) {
      return stream.layout.predictor == engine;
    });
    ASSERT_NE(like, engines->streams.end());
    simulation = std::make_unique<Heap>(*like);
    auto made = host::Host::create(std::move(*config), *simulation, *server_port);
    ASSERT_TRUE(made) << made.error().message;
    host_ = std::move(*made);
  }
  void run(double seconds) {
    for (const std::int64_t end_ns = now_ns + std::llround(seconds * 1e9); now_ns < end_ns;
         now_ns += kTickNs) {
      network.advance_to(now_ns);
      host_->poll(now_ns, now_ns + kWallNs);
      ASSERT_TRUE(host::drain(host_->outbox(), *server_port));
      for (std::string& line : host_->take_notices()) notices.push_back(std::move(line));
      if (client) client->core->poll({now_ns, now_ns + kWallNs});
    }
  }
  [[nodiscard]] std::string log() const {
    std::string all;
    for (const std::string& line : notices) all += line + '\n';
    return all;
  }

  std::int64_t now_ns = 1'000'000'000;
  transport::simulated::Network network{{.seed = 5, .link = {.delay_ns = 5'000'000}}};
  std::unique_ptr<transport::ServerPort> server_port;
  std::unique_ptr<Heap> simulation;
  std::unique_ptr<host::Host> host_;
  std::unique_ptr<Listening> client;
  std::vector<std::string> notices;
};

TEST_F(TrialsTest, AClientFollowsToAStreamThatPaysWithoutAGap) {
  start("hard");
  client = std::make_unique<Listening>(network, "bandwidth");
  run(3);
  ASSERT_EQ(client->core->phase(), ClientPhase::kPlaying);
  ASSERT_EQ(client->core->session()->streams.size(), 4U) << "the third is on trial, in both delays";
  for (int i = 0; i < 12; ++i) {  // gravity turns while streams are on trial, too
    run(10);
    const double aside = i % 2 == 0 ? 1 : -1;
    ASSERT_TRUE(
        client->core->send(transport::InputKind::kGravity, {aside, -9.7, 0}, {}, {now_ns, now_ns + kWallNs}));
  }
  EXPECT_EQ(client->core->session()->streams.size(), 6U) << log();
  EXPECT_NE(log().find("stream hard (hard) is offered from now on"), std::string::npos) << log();
  EXPECT_EQ(client->played, (std::vector<std::string>{"thin", "hard"})) << log();
  EXPECT_EQ(client->core->statistics().resyncs, 0U);
  EXPECT_EQ(client->core->statistics().hash_mismatches, 0U);
  EXPECT_EQ(client->snapshots, 1U) << "the one it joined by; on_applied() saw that no frame was missing";
  EXPECT_GE(client->last + 1, host_->frame());
}

TEST_F(TrialsTest, AStreamThatWouldNotGainIsLeftAlone) {
  start("field");
  client = std::make_unique<Listening>(network, "bandwidth");
  run(300);
  EXPECT_NE(log().find("hard (hard) would take"), std::string::npos) << "it was measured: " << log();
  EXPECT_EQ(log().find("is offered"), std::string::npos) << log();
  EXPECT_EQ(client->core->session()->streams.size(), 4U);
  EXPECT_EQ(client->played, (std::vector<std::string>{"thin", "rich"}))
      << "where field pays; and it stays there: " << log();
  EXPECT_EQ(client->core->statistics().resyncs, 0U);
}

/// What a gateway or a relay hears.
class Passing final : public following::SessionSink {
 public:
  void on_session(const transport::SessionMessage& session) override {
    ++sessions;
    EXPECT_EQ(session.streams.size(), 1U) << "the one that is played";
  }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override { last = snapshot.frame; }
  void on_applied(const client::CompleteDelta& delta, std::int64_t /*now_ns*/) override {
    EXPECT_EQ(delta.frame, last + 1);
    last = delta.frame;
  }

  void on_polled(Now now) override { polled_ns = now.steady_ns; }

  int sessions = 0;
  std::int64_t polled_ns = 0;
  Frame last = 0;
};

TEST_F(TrialsTest, WhoPassesAStreamOnIsNotToldOfAnotherSession) {
  start("hard");
  const auto port = std::move(*network.make_client("default"));
  CoreOptions options;
  options.session = "default";
  options.id = 200;
  options.prefer = "thin";
  following::SessionClient relay(std::move(options), *port);
  Passing sink, second;
  const std::array<following::SessionSink*, 2> sinks{&sink, &second};
  for (int i = 0; i < 15'000; ++i) {
    run(kTickNs * 1e-9);
    relay.poll(sinks, {now_ns, now_ns + kWallNs});
  }
  EXPECT_EQ(relay.core().session()->streams.size(), 6U) << log();
  EXPECT_EQ(sink.sessions, 1) << "all that belongs to a stream would be dropped";
  EXPECT_GT(sink.last, 1700U);
  EXPECT_EQ(second.last, sink.last);
  EXPECT_EQ(second.polled_ns, now_ns);
}

planning::PlannedWorld room_told_wrongly() {
  planning::PlannedWorld world = room();
  // Twice as large as they are: they would have to move apart all the time.
  world.types[0].bounding_radius = world.types[0].contact_radius = 2 * kRadius;
  return world;
}

TEST_F(TrialsTest, AStreamThatDoesNotPayIsNotOfferedAnyMore) {
  start("hard", room_told_wrongly());
  client = std::make_unique<Listening>(network, "thin");
  run(3);
  ASSERT_EQ(client->core->session()->streams.size(), 4U);
  run(57);
  EXPECT_EQ(client->core->session()->streams.size(), 2U) << "`thin` in two delays: " << log();
  EXPECT_NE(log().find("stream rich (field) is not offered from now on"), std::string::npos) << log();
  EXPECT_EQ(client->core->statistics().resyncs, 0U);
  EXPECT_GE(client->last + 1, host_->frame());
}

TEST_F(TrialsTest, AStreamThatDoesNotPayIsWithdrawnOnceItsLastClientLeftIt) {
  start("hard", room_told_wrongly());
  client = std::make_unique<Listening>(network, "bandwidth");
  run(1);
  client->core->prefer("rich");
  run(3);
  client->core->prefer("bandwidth");
  run(60);
  EXPECT_EQ(client->core->status().stream, "thin") << log();
  EXPECT_EQ(client->core->session()->streams.size(), 2U) << "once nobody plays it: " << log();
  EXPECT_EQ(client->core->statistics().resyncs, 0U);
}

TEST_F(TrialsTest, AStreamThatSomebodyPlaysIsNotWithdrawn) {
  start("hard", room_told_wrongly());
  client = std::make_unique<Listening>(network, "rich");
  run(60);
  EXPECT_EQ(client->core->session()->streams.size(), 4U) << log();
  EXPECT_EQ(client->played, (std::vector<std::string>{"rich"}));
}

TEST_F(TrialsTest, WhoAskedForAStreamByNameKeepsIt) {
  start("hard");
  client = std::make_unique<Listening>(network, "thin");
  run(60);
  EXPECT_EQ(client->core->session()->streams.size(), 6U) << log();
  EXPECT_EQ(client->played, (std::vector<std::string>{"thin"}));
}

}  // namespace
}  // namespace tandem::client
