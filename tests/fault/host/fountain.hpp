#pragma once
// A small world of the particle engine for tests of servers that are continued, and a client that remembers
// what it was told.

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "services/engines/particles/particles.hpp"
#include "tests/fault/host/stage.hpp"

namespace tandem::host {

inline constexpr std::uint32_t kSlots = 60;

/// Bodies that appear, fall and are removed, so that slots are used again.
inline engine::EngineWorld fountain() {
  engine::EngineWorld world;
  world.capacity = kSlots;
  world.seed = 7;
  world.types = {{0.3F, 1}};
  world.low = {-20, -20, -20};
  world.high = {20, 20, 20};
  world.planes = {{{0, 1, 0}, -2}};
  world.emitters = {{{-3, 3, -3}, {3, 4, 3}, {0, 2, 0}, 25, 0}};
  world.regions = {{{-20, -3, -20}, {20, -1.2F, 20}, engine::Region::Action::kRemove, {}, 0}};
  return world;
}

/// The particle engine, which writes down the frame on which each input acts, and the bodies of each frame.
class Logged final : public engine::Simulation {
 public:
  using Positions = std::vector<float>;

  Logged() : engine_(must(engine::make_particles(fountain(), 1))) {}
  [[nodiscard]] std::uint32_t capacity() const override { return engine_->capacity(); }
  [[nodiscard]] double dt_s() const override { return engine_->dt_s(); }
  [[nodiscard]] engine::Vec3 gravity() const override { return engine_->gravity(); }
  [[nodiscard]] double damping_per_s() const override { return engine_->damping_per_s(); }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    return engine_->classify(input);
  }
  void apply(const engine::Input& input) override {
    engine_->apply(input);
    acted.emplace_back(frame + 1, input.values[0]);
  }
  void step() override {
    engine_->step();
    ++frame;
    const auto bodies = engine_->bodies();
    Positions& now = positions[frame];
    for (std::uint32_t slot = 0; slot < kSlots; ++slot)
      if (bodies.alive[slot] != 0)
        now.insert(now.end(), {bodies.position[0][slot], bodies.velocity[1][slot]});
  }
  [[nodiscard]] engine::Bodies bodies() const override { return engine_->bodies(); }
  [[nodiscard]] std::span<const engine::Event> events() const override { return engine_->events(); }
  void save(std::vector<std::byte>& out) const override { engine_->save(out); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override { return engine_->load(bytes); }

  Frame frame = 0;
  std::vector<std::pair<Frame, double>> acted;  // by what makes an input unique
  std::map<Frame, Positions> positions;

 private:
  std::unique_ptr<engine::Simulation> engine_;
};

class Watcher final : public client::CoreListener {
 public:
  /// The last word about each input; a number that is told twice is only ever told acted, then lost.
  std::map<std::uint64_t, client::InputOutcome> outcomes;
  std::map<std::uint64_t, int> lost;
  void on_outcome(const client::InputOutcome& outcome) override {
    if (outcome.kind == client::InputOutcome::Kind::kLost) ++lost[outcome.number];
    EXPECT_TRUE(!outcomes.contains(outcome.number) || outcome.kind == client::InputOutcome::Kind::kLost);
    outcomes[outcome.number] = outcome;
  }
};

}  // namespace tandem::host
