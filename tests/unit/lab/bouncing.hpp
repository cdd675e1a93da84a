#pragma once
// A simulation small enough to know what must come out.

#include <array>
#include <cmath>
#include <vector>

#include "tandem/simulation.hpp"

namespace tandem::lab {

/// Bodies that fall freely and bounce on the plane y = 0; body i starts i / 100 higher. Gravity turns at an
/// input. With `turn_rad_per_s` they turn about z, the other way round after each bounce.
class Bouncing final : public engine::Simulation {
 public:
  static constexpr double kDt = 1.0 / 30;

  explicit Bouncing(std::uint32_t bodies, float turn_rad_per_s = 0) : bodies_(bodies) {
    for (auto& column : position_) column.assign(bodies_, 0);
    for (auto& column : velocity_) column.assign(bodies_, 0);
    for (std::size_t i = 0; i < bodies_; ++i) position_[1][i] = static_cast<float>(i) * 0.01F;
    alive_.assign(bodies_, 1);
    type_.assign(bodies_, 0);
    if (turn_rad_per_s == 0) return;
    angle_.assign(bodies_, 0);
    for (auto& column : orientation_) column.assign(bodies_, 0);
    for (auto& column : turning_) column.assign(bodies_, 0);
    orientation_[3].assign(bodies_, 1);
    turning_[2].assign(bodies_, turn_rad_per_s);
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
      const bool bounced = position_[1][i] < 0;
      if (bounced) velocity_[1][i] = std::fabs(velocity_[1][i]);
      if (!angle_.empty()) turn(i, bounced);
    }
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    return {{position_[0], position_[1], position_[2]},
            {velocity_[0], velocity_[1], velocity_[2]},
            alive_,
            type_,
            {orientation_[0], orientation_[1], orientation_[2], orientation_[3]},
            {turning_[0], turning_[1], turning_[2]}};
  }
  [[nodiscard]] std::span<const engine::Event> events() const override { return {}; }
  [[nodiscard]] std::uint32_t colliding() const override { return 7; }
  void save(std::vector<std::byte>&) const override {}
  [[nodiscard]] bool load(std::span<const std::byte>) override { return false; }

 private:
  void turn(std::size_t body, bool bounced) {
    angle_[body] += kDt * static_cast<double>(turning_[2][body]);
    if (bounced) turning_[2][body] = -turning_[2][body];
    orientation_[2][body] = static_cast<float>(std::sin(angle_[body] / 2));
    orientation_[3][body] = static_cast<float>(std::cos(angle_[body] / 2));
  }

  std::uint32_t bodies_;
  engine::Vec3 gravity_{0, -9.81, 0};
  std::array<std::vector<float>, 3> position_, velocity_, turning_;
  std::array<std::vector<float>, 4> orientation_;  // empty unless they turn, as angle_ is
  std::vector<double> angle_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint16_t> type_;
};

}  // namespace tandem::lab
