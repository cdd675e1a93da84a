#pragma once
// The particle engine, which writes down the frame on which each input acts.

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "services/engines/particles/particles.hpp"

namespace tandem::world {

class WatchedEngine : public engine::Simulation {
 public:
  explicit WatchedEngine(const engine::EngineWorld& world) {
    auto made = engine::make_particles(world, 1);
    if (!made) throw std::runtime_error(made.error().message);
    engine_ = std::move(*made);
  }
  [[nodiscard]] std::uint32_t capacity() const override { return engine_->capacity(); }
  [[nodiscard]] double dt_s() const override { return engine_->dt_s(); }
  [[nodiscard]] engine::Vec3 gravity() const override { return engine_->gravity(); }
  [[nodiscard]] double damping_per_s() const override { return engine_->damping_per_s(); }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    return engine_->classify(input);
  }
  [[nodiscard]] engine::InputBudget input_budget() const override { return engine_->input_budget(); }
  [[nodiscard]] engine::Mishaps mishaps() const override { return engine_->mishaps(); }
  [[nodiscard]] std::uint32_t colliding() const override { return engine_->colliding(); }
  void apply(const engine::Input& input) override {
    engine_->apply(input);
    acted.emplace_back(frame + 1, input.values[0]);
  }
  void step() override {
    engine_->step();
    ++frame;
  }
  [[nodiscard]] engine::Bodies bodies() const override { return engine_->bodies(); }
  [[nodiscard]] std::span<const engine::Event> events() const override { return engine_->events(); }
  void save(std::vector<std::byte>& out) const override { engine_->save(out); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override { return engine_->load(bytes); }

  // What the faults do to an engine that is another process.
  virtual void die() {}
  virtual void set_stopped(bool /*stopped*/) {}
  /// Finishes the step under way now. False: it does not.
  virtual bool finish_step() { return true; }

  Frame frame = 0;
  std::vector<std::pair<Frame, double>> acted;  ///< and the value that makes the input unique

 private:
  std::unique_ptr<engine::Simulation> engine_;
};

}  // namespace tandem::world
