#pragma once
// A small full simulation for fault tests: bodies that fall, bounce and are kicked about, seeded.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "tandem/simulation.hpp"

namespace tandem::client {

class Wanderers final : public engine::Simulation {
 public:
  Wanderers(std::uint32_t bodies, std::uint64_t seed)
      : random_(seed * 2 + 1), alive_(bodies, 1), type_(bodies, 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position_[axis].resize(bodies);
      velocity_[axis].assign(bodies, 0.0F);
      for (float& p : position_[axis]) p = static_cast<float>(uniform() * 2 - 1);
    }
  }

  [[nodiscard]] std::uint32_t capacity() const override { return static_cast<std::uint32_t>(alive_.size()); }
  [[nodiscard]] double dt_s() const override { return 1.0 / 30; }
  [[nodiscard]] engine::Vec3 gravity() const override { return gravity_; }
  [[nodiscard]] double damping_per_s() const override { return 0.1; }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    engine::Classification c;
    const bool fine =
        std::all_of(input.values.begin(), input.values.end(), [](double v) { return std::abs(v) < 100; });
    if (input.kind == static_cast<std::uint32_t>(engine::InputKind::kGravity) && input.values.size() == 3 &&
        fine) {
      c.effect = engine::Classification::Effect::kScheduled;
      c.gravity = {input.values[0], input.values[1], input.values[2]};
      c.damping_per_s = damping_per_s();
    } else if (input.kind == static_cast<std::uint32_t>(engine::InputKind::kPush) &&
               input.values.size() == 7 && fine) {
      c.effect = engine::Classification::Effect::kImmediate;
    } else if (!fine) {
      c.reason = "beyond 100";
    }
    return c;
  }
  void apply(const engine::Input& input) override {
    acted.emplace_back(input.values, steps_ + 1);
    if (input.kind == static_cast<std::uint32_t>(engine::InputKind::kGravity)) {
      gravity_ = {input.values[0], input.values[1], input.values[2]};
    } else {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (float& v : velocity_[axis]) v += static_cast<float>(input.values[4 + axis]);
      }
    }
  }
  void step() override {
    ++steps_;
    constexpr float kDt = 1.0F / 30;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto g = static_cast<float>(gravity_[axis]);
      for (std::size_t i = 0; i < alive_.size(); ++i) {
        float& p = position_[axis][i];
        float& v = velocity_[axis][i];
        v = (v + g * kDt) * 0.997F;
        if (uniform() < 0.03) v += static_cast<float>(uniform() * 2 - 1);
        p += v * kDt;
        if (std::abs(p) > 1.5F) {
          p = std::copysign(1.5F, p);
          v = -0.7F * v;
        }
      }
    }
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    return {.position = {position_[0], position_[1], position_[2]},
            .velocity = {velocity_[0], velocity_[1], velocity_[2]},
            .alive = alive_,
            .type = type_};
  }
  [[nodiscard]] std::span<const engine::Event> events() const override { return {}; }
  [[nodiscard]] std::uint32_t colliding() const override { return 0; }
  [[nodiscard]] std::vector<engine::BodyName> names() const override { return body_names; }
  [[nodiscard]] std::uint64_t names_version() const override { return names_version_now; }
  void save(std::vector<std::byte>& out) const override { out.clear(); }
  [[nodiscard]] bool load(std::span<const std::byte> /*bytes*/) override { return false; }

  std::vector<engine::BodyName> body_names;
  std::uint64_t names_version_now = 0;  ///< another value tells that body_names changed
  /// Values of each input and the step it acted in.
  std::vector<std::pair<std::vector<double>, std::uint64_t>> acted;

 private:
  double uniform() {
    random_ = random_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(random_ >> 33U) / static_cast<double>(1ULL << 31U);
  }
  std::uint64_t random_;
  std::uint64_t steps_ = 0;
  engine::Vec3 gravity_{0, -5, 0};
  std::array<std::vector<float>, 3> position_, velocity_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint16_t> type_;
};

}  // namespace tandem::client
