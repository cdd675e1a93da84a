// The same engine linked in and behind the door makes the same bytes.
#include <gtest/gtest.h>

#include "sdk/wire/clock.hpp"
#include "services/engines/door/door.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/waiting.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

constexpr std::uint32_t kBodies = 500;
constexpr const char* kScene = "four_cubes";

struct Played {
  std::vector<transport::DeltaMessage> deltas;
  std::vector<transport::ScheduledInputMessage> scheduled;
  std::optional<Error> error;
};

engine::Input push(double x) {
  return {.kind = static_cast<std::uint32_t>(engine::InputKind::kPush), .values = {x, 0, 0, 3, 0, 0.5, 0.25}};
}
engine::Input gravity(double x) {
  return {.kind = static_cast<std::uint32_t>(engine::InputKind::kGravity), .values = {x, -9, 1}};
}

HostConfig config_of(const scenes::Scene& scene) {
  sessions::SessionChoice choice;
  choice.bodies = kBodies;
  auto config = planning::plan_server(sessions::world_of(scene, kBodies), choice, {});
  EXPECT_TRUE(config.has_value());
  config->epoch = 1'700'000'000'000;
  config->claim_ns = 0;
  return std::move(*config);
}

// Frames from `host`'s own to `last`, with inputs that come at the same frames.
void play(Host& host, FakePort& port, Frame last, std::int64_t& now) {
  const auto drain = [&] {
    while (const auto message = host.outbox().pop(std::chrono::nanoseconds{0}))
      static_cast<void>(publish(port, *message));
  };
  const std::int64_t until = transport::steady_ns() + 60 * kSecond;
  while (host.frame() < last && !host.error() && transport::steady_ns() < until) {
    if (!host.frame_under_way()) now += Bench::kPeriod;
    const bool produced = host.poll(now, Bench::kWallStart + now);
    wait_for_work(host, port, std::chrono::milliseconds{host.frame_under_way() ? 5 : 0});
    drain();
    if (!produced) continue;
    if (host.frame() % 40 == 7) {
      ASSERT_TRUE(host.inject(gravity(static_cast<double>(host.frame() % 5))));
    }
    if (host.frame() % 25 == 3) {
      ASSERT_TRUE(host.inject(push(static_cast<double>(host.frame() % 7) - 3)));
    }
  }
}

Played play_all(engine::Simulation& simulation, const HostConfig& config, Frame last) {
  FakePort port(participant(0xAA));
  auto host = Host::create(config, simulation, port);
  EXPECT_TRUE(host.has_value()) << host.error().message;
  std::int64_t now = 5 * kSecond;
  play(**host, port, last, now);
  return {std::move(port.deltas), std::move(port.scheduled), (*host)->error()};
}

// `lines`: further lines of HELLO; "tcp": none, but over the network.
std::unique_ptr<engine::door::Door> open_door(const std::string& lines) {
  const bool network = lines == "tcp";
  const std::string command = std::string(DOOR_ENGINE) + " particles " + kScene + " " +
                              std::to_string(kBodies) + " 1 " + (network ? "" : lines);
  auto door = engine::door::Door::open({.way = {.command = command, .host = network ? "127.0.0.1" : ""}});
  EXPECT_TRUE(door.has_value()) << door.error().message;
  return door ? std::move(*door) : nullptr;
}

class SameWorld : public ::testing::TestWithParam<const char*> {};

TEST_P(SameWorld, BehindTheDoorAsLinkedIn) {
  const auto scene = scenes::load_scene(kScene);
  ASSERT_TRUE(scene.has_value());
  const HostConfig config = config_of(*scene);
  const auto linked = scenes::make_simulation(*scene, kBodies, 1, 1);
  ASSERT_TRUE(linked.has_value());
  const auto door = open_door(GetParam());
  ASSERT_NE(door, nullptr);
  const Played there = play_all(*door, config, 300), here = play_all(**linked, config, 300);
  ASSERT_FALSE(there.error.has_value()) << there.error->message;
  ASSERT_GE(here.deltas.size(), 300U);
  ASSERT_EQ(there.deltas.size(), here.deltas.size());
  for (std::size_t i = 0; i < here.deltas.size(); ++i) {
    ASSERT_EQ(there.deltas[i].hash, here.deltas[i].hash) << "frame " << here.deltas[i].frame;
    ASSERT_EQ(there.deltas[i].payload, here.deltas[i].payload) << "frame " << here.deltas[i].frame;
  }
  EXPECT_EQ(there.scheduled.size(), here.scheduled.size());
}

INSTANTIATE_TEST_SUITE_P(Forms, SameWorld, ::testing::Values("", "float=64", "memory=inline", "tcp"));

class DoorCheckpoint : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Forms, DoorCheckpoint, ::testing::Values("", "memory=inline", "tcp"));

TEST_P(DoorCheckpoint, AnotherEngineGoesOnFromItToTheBit) {
  const auto scene = scenes::load_scene(kScene);
  ASSERT_TRUE(scene.has_value());
  const auto first = open_door(GetParam()), second = open_door(GetParam());
  ASSERT_TRUE(first && second);
  for (int i = 0; i < 40; ++i) {
    if (i == 10) first->apply(gravity(3));
    first->step();
  }
  std::vector<std::byte> saved;
  first->save(saved);
  ASSERT_FALSE(saved.empty());
  ASSERT_TRUE(second->load(saved));
  EXPECT_EQ(second->gravity(), first->gravity());
  for (int i = 0; i < 20; ++i) {
    first->step();
    second->step();
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_TRUE(std::ranges::equal(first->bodies().position[axis], second->bodies().position[axis]));
  saved.resize(saved.size() / 2);
  EXPECT_FALSE(second->load(saved)) << "the engine refuses half of a checkpoint";
  second->step();
  EXPECT_EQ(second->failure(), "") << "and goes on";
  EXPECT_FALSE(second->load(std::vector<std::byte>(100)));
}

}  // namespace
}  // namespace tandem::host
