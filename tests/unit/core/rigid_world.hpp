#pragma once
// A room for the predictor `rigid`, and bodies for it. Lengths in half edges of a cube of type 0; the
// threshold is a tenth of it.

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>

#include "sdk/core/lattice/turn.hpp"
#include "sdk/core/predict/rigid/rigid.hpp"
#include "tests/unit/core/contact_world.hpp"

namespace tandem::of_rigid {

inline constexpr std::int32_t kHalf = 20000;
inline constexpr std::int32_t kThreshold = kHalf / 10;
inline constexpr Vec3i kGravity{0, -28000, 0};  // 0.22 thresholds a frame^2
inline constexpr TypeId kCube = 0, kBall = 1, kCapsule = 2, kBoard = 3;

inline StepInput input_of(const Vec3i& gravity) {
  StepParameters parameters{.decay = 800, .contacts = {.listed = true, .friction = 1024}};
  return {{gravity, 0}, parameters, kThreshold, gravity};
}

// A room of six planes, 8 half edges wide and deep.
inline RigidConstants room(std::int32_t substeps = 4) {
  RigidConstants constants;
  constants.contact = constants_of(substeps);
  constants.contact.boxes.clear();
  constants.contact.balls.clear();
  constants.contact.planes.clear();
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::int32_t sign : {-1, 1}) {
      ContactConstants::Plane plane;
      plane.normal[i] = sign * ContactConstants::kOne;
      plane.offset = i == 1 && sign > 0 ? 0 : -(i == 1 ? 40 : 8) * kHalf;
      constants.contact.planes.push_back(plane);
    }
  }
  constants.contact.types.assign(4, {kHalf, 65536});
  constants.solids = {{Solid::Kind::kBox, {kHalf, kHalf, kHalf}},
                      {Solid::Kind::kRound, {kHalf, 0, 0}},
                      {Solid::Kind::kRound, {kHalf / 2, kHalf, 0}},
                      {Solid::Kind::kBox, {kHalf, kHalf / 4, kHalf / 2}}};
  return constants;
}

inline State make_state(std::uint32_t capacity) {
  State state(capacity, {.orientation = true});
  state.keep_for_predictor(1);
  return state;
}

inline std::unique_ptr<Predictor> rigid(std::uint32_t capacity, const RigidConstants& constants) {
  return *make_predictor("rigid", capacity, write_rigid_constants(constants));
}

inline Quaternion some_turn(std::mt19937_64& random) {
  Quaternion q = kNoTurn;
  for (int i = 0; i < 4; ++i) q = turned(q, vector_within(random, 1 << 27));
  return q;
}

// A loose block of bodies above the floor, each turned in some way; of all types, or cubes alone.
inline State block(std::uint32_t bodies, bool mixed) {
  std::mt19937_64 random(7);
  State state = make_state(bodies);
  for (Slot s = 0; s < bodies; ++s) {
    const auto i = static_cast<std::int32_t>(s);
    const auto at = [](std::int32_t cell) { return cell * (3 * kHalf + 700) - 6 * kHalf; };
    state.spawn(
        s, 0, static_cast<TypeId>(mixed ? s % 4 : 0),
        {{at(i % 5) + i * 13, at(i / 25) + 8 * kHalf, at(i / 5 % 5) + i * 7}, {}, some_turn(random), {}});
  }
  return state;
}

inline double moved(const State& a, const State& b, Slot s) {
  return std::sqrt(static_cast<double>(
      distance_squared({a.p(0)[s], a.p(1)[s], a.p(2)[s]}, {b.p(0)[s], b.p(1)[s], b.p(2)[s]})));
}

// Of motion and height, without that of spins; 1 is a thresholds^2 a frame^2.
inline double energy(const State& state) {
  double sum = 0;
  for (Slot s = 0; s < state.capacity(); ++s) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double v = state.v(i)[s] / 64.0 / kThreshold;
      sum += v * v / 2;
    }
    sum += -kGravity[1] / 64.0 / kThreshold * state.p(1)[s] / kThreshold;
  }
  return sum;
}

}  // namespace tandem::of_rigid
