// A simulation of one's own, streamed: balls in a box, which clients tilt and push. The server is told of
// walls and springs, so that clients can predict the contacts: streams `thin` and `rich`. own_simulation
// [SECONDS]: session "own_simulation" on DDS domain 0; `tandem join --session own_simulation` plays it.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <tandem/host.hpp>
#include <vector>

namespace {

using namespace tandem::engine;

class Balls final : public Simulation {
 public:
  static constexpr std::uint32_t kSide = 10, kBalls = kSide * kSide * kSide;
  static constexpr float kHalfBox = 5, kRadius = 0.45F;
  static constexpr float kSpring = 600, kDamping = 3;  // of a contact; balls have mass 1

  Balls() {
    for (std::uint32_t i = 0; i < kBalls; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint32_t step = axis == 0 ? i % kSide : axis == 1 ? i / kSide % kSide : i / kSide / kSide;
        p_[axis][i] = 0.9F * (static_cast<float>(step) - 4.5F);
        v_[axis][i] = std::sin(static_cast<float>(7 * i + axis));
      }
  }

  std::uint32_t capacity() const override { return kBalls; }
  double dt_s() const override { return 1.0 / 60; }
  Vec3 gravity() const override { return gravity_; }

  // Gravity changes what clients predict, so it is scheduled; a push acts here alone, at once.
  Classification classify(const Input& input) const override {
    for (const double value : input.values)
      if (!(std::abs(value) < 1000)) return {.reason = "out of range"};
    if (input.kind == 1 && input.values.size() == 3)
      return {.effect = Classification::Effect::kScheduled,
              .gravity = {input.values[0], input.values[1], input.values[2]}};
    if (input.kind == 2 && input.values.size() == 7) return {.effect = Classification::Effect::kImmediate};
    return {.reason = "neither gravity nor push"};
  }

  void apply(const Input& input) override {
    const auto& in = input.values;
    if (input.kind == 1) {
      gravity_ = {in[0], in[1], in[2]};
      return;
    }
    for (std::uint32_t i = 0; i < kBalls; ++i) {
      if (std::hypot(p_[0][i] - in[0], p_[1][i] - in[1], p_[2][i] - in[2]) > in[3]) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) v_[axis][i] += static_cast<float>(in[4 + axis]);
    }
  }

  void step() override {
    for (Column& column : f_) std::fill(column.begin(), column.end(), 0.0F);
    for (std::uint32_t i = 0; i < kBalls; ++i) {
      for (std::uint32_t j = 0; j < i; ++j) meet(i, j);
      meet_walls(i);
    }
    const auto dt = static_cast<float>(dt_s());
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::uint32_t i = 0; i < kBalls; ++i) {
        v_[axis][i] += (static_cast<float>(gravity_[axis]) + f_[axis][i]) * dt;
        p_[axis][i] += v_[axis][i] * dt;
      }
  }

  Bodies bodies() const override { return {{p_[0], p_[1], p_[2]}, {v_[0], v_[1], v_[2]}, alive_, type_}; }

 private:
  using Column = std::vector<float>;

  // Two balls push each other apart as tandem::Scenery::Law says, without shear.
  void meet(std::uint32_t i, std::uint32_t j) {
    const float d[3] = {p_[0][j] - p_[0][i], p_[1][j] - p_[1][i], p_[2][j] - p_[2][i]};
    const float squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (squared >= 4 * kRadius * kRadius || squared == 0) return;
    const float distance = std::sqrt(squared), overlap = 2 * kRadius - distance;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float force = -kSpring * overlap * d[axis] / distance + kDamping * (v_[axis][j] - v_[axis][i]);
      f_[axis][i] += force;
      f_[axis][j] -= force;
    }
  }

  void meet_walls(std::uint32_t i) {
    for (std::size_t wall = 0; wall < 3; ++wall) {
      const float overlap = std::abs(p_[wall][i]) + kRadius - kHalfBox;
      if (overlap <= 0) continue;
      f_[wall][i] -= std::copysign(kSpring * overlap, p_[wall][i]);
      for (std::size_t axis = 0; axis < 3; ++axis) f_[axis][i] -= kDamping * v_[axis][i];
    }
  }

  Vec3 gravity_{0, -9.81, 0};
  std::array<Column, 3> p_{Column(kBalls), Column(kBalls), Column(kBalls)}, v_ = p_, f_ = p_;
  std::vector<std::uint8_t> alive_ = std::vector<std::uint8_t>(kBalls, 1);
  std::vector<std::uint16_t> type_ = std::vector<std::uint16_t>(kBalls, 0);
};

tandem::Scenery walls() {
  const tandem::Scenery::Law law{.spring = Balls::kSpring, .damping = Balls::kDamping, .shear = 0};
  tandem::Scenery scenery{.between_bodies = law, .with_scenery = law};
  for (const double side : {-1.0, 1.0})
    for (const Vec3 normal : {Vec3{side, 0, 0}, Vec3{0, side, 0}, Vec3{0, 0, side}})
      scenery.planes.push_back({.normal = normal, .offset = -Balls::kHalfBox});
  return scenery;
}

}  // namespace

int main(int argc, char** argv) {
  Balls balls;
  auto server = tandem::Server::start({.session = "own_simulation",
                                       .threshold = 0.02,
                                       .extent = 20,
                                       .scenery = walls(),
                                       .types = {{.name = "ball", .radius = Balls::kRadius}}},
                                      balls);
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  const bool went_on = server->run_for(argc > 1 ? std::atof(argv[1]) : 3600);
  if (!went_on) std::fprintf(stderr, "%s\n", server->error().message.c_str());
  const tandem::ServerStatus status = server->status();
  std::printf("%llu frames, %llu bytes\n", static_cast<unsigned long long>(status.frame),
              static_cast<unsigned long long>(status.payload_bytes));
  return went_on && status.frame > 0 ? 0 : 1;
}
