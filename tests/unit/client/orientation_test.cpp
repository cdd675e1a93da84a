// Orientations in samples: pictures by hand, as a client's timeline would give them.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/client/taken.hpp"

namespace tandem::client::of_orientation {
namespace {

constexpr std::int64_t kFrameNs = 1'000'000'000 / 60;
constexpr Slot kSlots = 3;
constexpr double kLatticeUnit = 0.001;

Quaternion about_z(double angle) {
  return {0, 0, static_cast<std::int32_t>(std::lround(std::sin(angle / 2) * kQuaternionOne)),
          static_cast<std::int32_t>(std::lround(std::cos(angle / 2) * kQuaternionOne))};
}
Spin per_frame(double angle) { return {0, 0, static_cast<std::int32_t>(angle * (1 << 28))}; }

/// Bodies that turn about z, drawn at 60 Hz; the clock is the server's.
class OrientationTest : public ::testing::Test {
 protected:
  OrientationTest() : picture{.epoch = 1, .lattice_unit = kLatticeUnit, .pacer = Pacer(60)} {
    steady.forget(kSlots);
  }

  /// The picture of a client once `state` is agreed, with one frame simulated ahead.
  void agree(const State& state) {
    std::swap(frames[0], frames[1]);
    picture.before = frame_number == 0 ? nullptr : &frames[0];
    ++frame_number;
    now_ns = static_cast<std::int64_t>(frame_number) * kFrameNs;
    picture.pacer.on_delta(frame_number, now_ns, now_ns);
    draw(state, frame_number, jumps, steady, frames[1]);
    picture.agreed = &frames[1];
    State ahead = state;
    for (Slot slot = 0; slot < kSlots; ++slot) {
      if (state.groups().orientation && state.alive()[slot] != 0)
        ahead.set_quaternion(
            slot, turned(state.quaternion(slot), {state.w(0)[slot], state.w(1)[slot], state.w(2)[slot]}));
    }
    draw(ahead, frame_number + 1, jumps, steady, frames[2]);
    picture.ahead = &frames[2];
  }
  /// `share` of a frame after the last one.
  const Taken& take(SampleMode mode, double share) {
    const auto later = static_cast<std::int64_t>(share * static_cast<double>(kFrameNs));
    EXPECT_TRUE(sample.take(sampler, picture, {.mode = mode}, now_ns + later));
    return sample;
  }
  /// About z, of the last sample; rad in (-pi, pi].
  [[nodiscard]] double angle_of(Slot slot) const {
    const float* q = sample.orientations.data() + 4 * slot;
    EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-6);
    return std::remainder(2 * std::atan2(double{q[2]}, double{q[3]}), 2 * M_PI);
  }
  static State spun(double angle, double per_frame_rad) {
    State state(kSlots, {.orientation = true});
    for (Slot slot = 0; slot < 2; ++slot)
      state.spawn(slot, 0, 0, {.q = about_z(angle), .w = per_frame(per_frame_rad)});
    return state;
  }

  Accelerations steady;
  std::array<DrawnFrame, 3> frames;
  std::array<std::uint8_t, kSlots> jumps{};
  Picture picture;
  Sampler sampler;
  Taken sample;
  Frame frame_number = 0;
  std::int64_t now_ns = 0;
};

TEST_F(OrientationTest, ASessionWithoutThemGivesNone) {
  State state(kSlots);
  state.spawn(0, 0, 0, {});
  agree(state);
  EXPECT_FALSE(take(SampleMode::kExtrapolate, 0).has_orientations);
  EXPECT_FALSE(take(SampleMode::kInterpolate, 0).has_orientations);
}

TEST_F(OrientationTest, InterpolationTurnsFromOneAgreedFrameToTheNext) {
  agree(spun(0.1, 0));
  agree(spun(1.7, 0));
  for (const double share : {0.0, 0.25, 0.5, 0.75}) {
    take(SampleMode::kInterpolate, share);
    const double moment = sample.frame - 1;
    EXPECT_NEAR(moment, share, 0.01);
    EXPECT_NEAR(angle_of(0), 0.1 + 1.6 * moment, 1e-4);
  }
}

TEST_F(OrientationTest, InterpolationTakesTheShorterWayWhicheverSign) {
  agree(spun(0.1, 0));
  State next = spun(0.5, 0);
  const Quaternion q = next.quaternion(0);
  next.set_quaternion(0, {-q[0], -q[1], -q[2], -q[3]});
  agree(next);
  take(SampleMode::kInterpolate, 0.5);
  EXPECT_NEAR(angle_of(0), angle_of(1), 1e-6);
}

TEST_F(OrientationTest, ExtrapolationTurnsOnAtTheAngularVelocity) {
  double angle = 0;
  for (int frame = 0; frame < 20; ++frame) agree(spun(angle += 0.3, 0.3));
  for (const double share : {0.0, 0.5, 1.0, 1.5, 1.9, 2.5}) {
    take(SampleMode::kExtrapolate, share);
    EXPECT_NEAR(angle_of(0), std::remainder(sample.frame * 0.3, 2 * M_PI), 1e-5) << "share " << share;
  }
}

TEST_F(OrientationTest, ACorrectionIsBlendedInWithATimeConstantOfThreeFrames) {
  for (int frame = 0; frame < 20; ++frame) {
    agree(spun(0, 0));
    take(SampleMode::kExtrapolate, 0.5);
  }
  // At 60 Hz.
  double last = 0;
  for (int frame = 0; frame < 30; ++frame) {
    agree(spun(1, 0));
    take(SampleMode::kExtrapolate, 0.5);
    EXPECT_LT(angle_of(0) - last, 0.3);
    EXPECT_NEAR(1 - angle_of(0), std::exp(-(frame + 1) / 3.0), 0.01);
    last = angle_of(0);
  }
  EXPECT_NEAR(last, 1, 0.01);
  agree(spun(1, 0));
  EXPECT_EQ(picture.agreed->quaternion(0), about_z(1)) << "only what is drawn is blended";
}

TEST_F(OrientationTest, ABlendFollowsABodyThatTurns) {
  double angle = 0;
  const auto next = [&](double beside) {
    agree(spun((angle += 0.5) + beside, 0.5));
    take(SampleMode::kExtrapolate, 0.5);
    return std::remainder(angle_of(0) - sample.frame * 0.5, 2 * M_PI);
  };
  for (int frame = 0; frame < 20; ++frame) next(0);
  double before = 0;
  for (int frame = 0; frame < 30; ++frame) {
    const double beside = next(0.4);
    EXPECT_GT(beside, before - 1e-5);
    EXPECT_LT(beside - before, 0.12);
    before = beside;
  }
  EXPECT_NEAR(before, 0.4, 0.01);
}

TEST_F(OrientationTest, NothingTurnsAcrossASpawnOrATeleport) {
  for (int frame = 0; frame < 20; ++frame) {
    agree(spun(0.2, 0));
    take(SampleMode::kExtrapolate, 0.5);
  }
  State next = spun(0.2, 0);
  next.set_quaternion(1, about_z(2));
  next.spawn(2, 0, 0, {.q = about_z(-1)});
  ++jumps[1];
  ++jumps[2];
  agree(next);
  take(SampleMode::kInterpolate, 0.25);
  EXPECT_NEAR(angle_of(0), 0.2, 1e-6);
  EXPECT_NEAR(angle_of(1), 2, 1e-6);
  EXPECT_NEAR(angle_of(2), -1, 1e-6);
  EXPECT_EQ(sample.changes[1], BodyChange::kJumped);
  EXPECT_EQ(sample.changes[2], BodyChange::kNew);

  next.set_quaternion(1, about_z(-2));
  ++jumps[1];
  agree(next);
  take(SampleMode::kExtrapolate, 0.25);
  EXPECT_NEAR(angle_of(1), -2, 1e-6);
}

TEST_F(OrientationTest, AnotherEpochWithoutThemHasNone) {
  agree(spun(0.2, 0));
  EXPECT_TRUE(take(SampleMode::kExtrapolate, 0).has_orientations);
  picture.epoch = 2;
  State points(kSlots);
  points.spawn(0, 0, 0, {});
  agree(points);
  picture.before = nullptr;
  EXPECT_FALSE(take(SampleMode::kExtrapolate, 0).has_orientations);
}

}  // namespace
}  // namespace tandem::client::of_orientation
