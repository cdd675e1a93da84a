#pragma once
// A simulation small enough to know what must come out.

#include <array>
#include <cmath>
#include <vector>

#include "services/host/simulation.hpp"

namespace tandem::lab {

/// Bodies that fall freely and bounce on the plane y = 0; body i starts i / 100 higher. Gravity turns at an
/// input.
class Bouncing final : public engine::Simulation {
 public:
  static constexpr double kDt = 1.0 / 30;

  explicit Bouncing(std::uint32_t bodies) : bodies_(bodies) {
    for (auto& column : position_) column.assign(bodies_, 0);
    for (auto& column : velocity_) column.assign(bodies_, 0);
    for (std::size_t i = 0; i < bodies_; ++i) position_[1][i] = static_cast<float>(i) * 0.01F;
    alive_.assign(bodies_, 1);
    type_.assign(bodies_, 0);
  }
  [[nodiscard]] std::uint32_t capacity() const override { return bodies_; }
  [[nodiscard]] double dt_s() const override { return kDt; }
  [[nodiscard]] engine::Vec3 gravity() const override { return gravity_; }
  [[nodiscard]] double damping_per_s() const override { return 0; }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    engine::Classification result;
    if (input.values.size() != 3) return result;
    result.effect = engine::Classification::Effect::kScheduled;
    result.gravity = {input.values[0], input.values[1], input.values[2]};
    return result;
  }
  void apply(const engine::Input& input) override {
    gravity_ = {input.values[0], input.values[1], input.values[2]};
  }
  void step() override {
    for (std::size_t i = 0; i < bodies_; ++i) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        velocity_[channel][i] += static_cast<float>(gravity_[channel] * kDt);
        position_[channel][i] += static_cast<float>(kDt) * velocity_[channel][i];
      }
      if (position_[1][i] < 0) velocity_[1][i] = std::fabs(velocity_[1][i]);
    }
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    return {{position_[0], position_[1], position_[2]},
            {velocity_[0], velocity_[1], velocity_[2]},
            alive_,
            type_};
  }
  [[nodiscard]] std::span<const engine::Event> events() const override { return {}; }
  [[nodiscard]] std::uint32_t colliding() const override { return 7; }
  void save(std::vector<std::byte>&) const override {}
  [[nodiscard]] bool load(std::span<const std::byte>) override { return false; }

 private:
  std::uint32_t bodies_;
  engine::Vec3 gravity_{0, -9.81, 0};
  std::array<std::vector<float>, 3> position_, velocity_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint16_t> type_;
};

}  // namespace tandem::lab
