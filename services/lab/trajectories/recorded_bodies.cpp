#include "services/lab/trajectories/recorded_bodies.hpp"

#include <algorithm>
#include <span>

namespace tandem::lab {
namespace {

constexpr double kVelocity = 1.0 / 64;  // of a lattice unit per frame
constexpr double kTurn = 1.0 / kQuaternionOne;
constexpr double kSpin = 1.0 / (1 << 28);  // rad per frame
constexpr double kDamping = 1.0 / 65536;

void fill(std::vector<float>& column, std::span<const std::int32_t> from, double scale) {
  column.resize(from.size());
  std::ranges::transform(from, column.begin(),
                         [scale](std::int32_t value) { return static_cast<float>(value * scale); });
}

}  // namespace

engine::Bodies RecordedBodies::of(const State& state) {
  auto& c = columns_;
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    fill(c[i], state.p(i), unit_);
    fill(c[3 + i], state.v(i), kVelocity * unit_ / dt_s_);
  }
  for (std::size_t i = 0; i < kQuaternionChannels; ++i) fill(c[6 + i], state.q(i), kTurn);
  for (std::size_t i = 0; i < kSpinChannels; ++i) fill(c[10 + i], state.w(i), kSpin / dt_s_);
  return {.position = {c[0], c[1], c[2]},
          .velocity = {c[3], c[4], c[5]},
          .alive = state.alive(),
          .type = state.type(),
          .orientation = {c[6], c[7], c[8], c[9]},
          .angular_velocity = {c[10], c[11], c[12]}};
}

engine::Vec3 RecordedBodies::gravity(const Drive& drive) const {
  const double scale = kVelocity * unit_ / (dt_s_ * dt_s_);
  return {drive.gravity[0] * scale, drive.gravity[1] * scale, drive.gravity[2] * scale};
}

double RecordedBodies::damping_per_s(const Drive& drive) const { return drive.damping * kDamping / dt_s_; }

}  // namespace tandem::lab
