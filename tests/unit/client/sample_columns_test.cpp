// The memory that samples are written to, and their moments.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/client/fake_server.hpp"
#include "tests/support/client/taken.hpp"

namespace tandem::client {
namespace {

class SampleColumnsTest : public ClientTest {
 protected:
  void play(int frames) {
    for (int i = 0; i < frames; ++i) frame();
  }
  Taken& take(const SampleRequest& request) {
    const auto taken = core->sample(request, sample.make_room(core->drawable()->capacity), now());
    EXPECT_TRUE(taken.has_value());
    if (taken) static_cast<SampledFrame&>(sample) = *taken;
    return sample;
  }
  [[nodiscard]] Now now() const { return {now_ns, wall_ns()}; }
  /// Where the client holds a body of the last agreed frame.
  [[nodiscard]] float agreed(Slot slot, std::size_t axis) const {
    const std::int32_t p = core->timeline()->state(core->timeline()->applied()).p(axis)[slot];
    return static_cast<float>(p * server.session.lattice_unit);
  }
  Taken sample;
};

TEST_F(SampleColumnsTest, BeforeTheFirstSnapshotThereIsNothingToDraw) {
  start();
  core->start_sampling();
  poll();
  EXPECT_FALSE(core->drawable().has_value());
  const auto taken = core->sample({}, sample.make_room(40), now());
  ASSERT_FALSE(taken.has_value());
  EXPECT_EQ(taken.error().code, ErrorCode::kOutOfOrder);
}

TEST_F(SampleColumnsTest, ColumnsThatAreTooShortAreLeftAsTheyAre) {
  join();
  core->start_sampling();
  std::vector<float> positions(3 * 39, 7);
  SampleColumns columns{.capacity = 39};
  columns.positions = packed(positions.data(), 3);
  const auto taken = core->sample({}, columns, now());
  ASSERT_FALSE(taken.has_value());
  EXPECT_EQ(taken.error().code, ErrorCode::kCapacity);
  EXPECT_EQ(positions, std::vector<float>(3 * 39, 7));
  EXPECT_EQ(core->drawable()->capacity, 40U);
}

TEST_F(SampleColumnsTest, AnArrayOfTheAppsOwnStructsIsFilledAsPackedColumnsAre) {
  // The struct has an odd size, so that nothing in it is aligned.
  constexpr std::size_t kStruct = 41;
  std::vector<std::byte> bodies(40 * kStruct, std::byte{0xEE});
  join();
  core->start_sampling();
  play(20);
  SampleColumns columns{.capacity = 40};
  const auto at = [&](std::size_t offset) { return static_cast<void*>(bodies.data() + offset); };
  columns.positions = {static_cast<float*>(at(1)), kStruct};
  columns.velocities = {static_cast<float*>(at(13)), kStruct};
  columns.types = {static_cast<std::uint16_t*>(at(25)), kStruct};
  columns.alive = {static_cast<std::uint8_t*>(at(27)), kStruct};
  columns.changes = {static_cast<std::uint8_t*>(at(28)), kStruct};
  ASSERT_TRUE(core->sample({.smoothing_s = 0}, columns, now()).has_value());
  take({.smoothing_s = 0});
  for (std::size_t slot = 0; slot < 40; ++slot) {
    const std::byte* const body = bodies.data() + slot * kStruct;
    EXPECT_EQ(std::memcmp(body + 1, &sample.positions[3 * slot], 12), 0);
    EXPECT_EQ(std::memcmp(body + 13, &sample.velocities[3 * slot], 12), 0);
    EXPECT_EQ(std::memcmp(body + 25, &sample.types[slot], 2), 0);
    EXPECT_EQ(std::memcmp(body + 27, &sample.alive[slot], 1), 0);
    EXPECT_EQ(body[0], std::byte{0xEE});
    EXPECT_EQ(body[29], std::byte{0xEE});
  }
}

TEST_F(SampleColumnsTest, VelocitiesAreHowFastPositionsMove) {
  join();
  core->start_sampling();
  play(30);
  for (const double smoothing_s : {0.0, 0.1}) {
    const std::vector<float> before = take({.smoothing_s = smoothing_s}).positions;
    poll(kMs);
    take({.smoothing_s = smoothing_s});
    for (std::size_t i = 0; i < before.size(); ++i)
      EXPECT_NEAR((sample.positions[i] - before[i]) / 0.001, sample.velocities[i],
                  0.02 * std::abs(sample.velocities[i]) + 0.05)
          << i;
  }
}

TEST_F(SampleColumnsTest, TheBodiesThatAreThereAreCounted) {
  join();
  core->start_sampling();
  play(5);
  take({});
  std::uint32_t alive = 0;
  for (const std::uint8_t body : sample.alive) alive += body;
  EXPECT_EQ(SampledFrame(sample).alive, alive);
  EXPECT_EQ(sample.epoch, server.session.epoch);
  EXPECT_FALSE(sample.has_orientations);
  poll(20 * kMs);
  take({});
  EXPECT_NEAR(sample.since_delta_s, 0.02, 1e-9);
}

TEST_F(SampleColumnsTest, TheFirstInterpolatedSampleHasTheVelocitiesOfItsFrame) {
  join();
  core->start_sampling();
  take({.mode = SampleMode::kInterpolate});
  const State& state = core->timeline()->state(core->timeline()->applied());
  const double metres_per_s = server.session.lattice_unit / 64 * server.session.frame_rate_hz;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NE(state.v(axis)[5], 0);
    EXPECT_NEAR(sample.velocities[15 + axis], state.v(axis)[5] * metres_per_s, 1e-3);
    EXPECT_NEAR(sample.positions[15 + axis], agreed(5, axis), 1e-5);
  }
}

TEST_F(SampleColumnsTest, OfAMomentLongAgoTheOldestFrameIsGiven) {
  join();
  core->start_sampling();
  play(9);
  std::array<float, 3> before{agreed(3, 0), agreed(3, 1), agreed(3, 2)};
  play(1);
  const auto applied = static_cast<double>(core->timeline()->applied());
  for (const SampleMode mode : {SampleMode::kInterpolate, SampleMode::kExtrapolate}) {
    for (const std::int64_t at_ns : {std::numeric_limits<std::int64_t>::min(), std::int64_t{1}}) {
      take({.mode = mode, .at_ns = at_ns, .smoothing_s = 0});
      EXPECT_EQ(sample.frame, applied - 1);
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(sample.positions[9 + axis], before[axis], 1e-3);
    }
  }
}

TEST_F(SampleColumnsTest, OfAMomentFarOffTheLastOneThatIsForeseenIsGiven) {
  join();
  core->start_sampling();
  play(10);
  const std::int64_t far_ns = std::numeric_limits<std::int64_t>::max();
  take({.mode = SampleMode::kInterpolate, .at_ns = far_ns});
  EXPECT_EQ(sample.frame, static_cast<double>(core->timeline()->applied()));
  take({.mode = SampleMode::kExtrapolate, .at_ns = far_ns});
  EXPECT_NEAR(sample.frame, static_cast<double>(core->timeline()->now()) + 6.75, 1e-6);
  const double shown = sample.frame;
  EXPECT_EQ(take({}).frame, shown) << "no earlier one was asked for";
  // And an earlier one is as if that had never been asked for.
  const Taken once = take({.at_ns = now_ns, .smoothing_s = 0});
  EXPECT_NEAR(once.frame, static_cast<double>(core->timeline()->now()), 1.1);
}

TEST_F(SampleColumnsTest, NoNumberMakesAPlaceThatIsNone) {
  join();
  core->start_sampling();
  play(10);
  for (const double smoothing_s : {std::nan(""), -HUGE_VAL, HUGE_VAL, 1e-300, 1e300}) {
    poll(kMs);
    take({.smoothing_s = smoothing_s});
    for (const float place : sample.positions) EXPECT_TRUE(std::isfinite(place));
    for (const float speed : sample.velocities) EXPECT_TRUE(std::isfinite(speed));
  }
}

TEST_F(SampleColumnsTest, AVelocityIsHowFastThePlaceMovesWithTheCorrectionBlendedIn) {
  join();
  core->start_sampling();
  for (int i = 0; i < 20; ++i) {
    frame();
    take({});
  }
  const Taken first = take({});
  now_ns += kMs;
  take({});
  for (std::size_t i = 0; i < first.positions.size(); ++i) {
    const float speed = first.velocities[i];
    EXPECT_NEAR((sample.positions[i] - first.positions[i]) / 1e-3F, speed, 0.05 + 0.03 * std::abs(speed));
  }
  const std::vector<float> blending = sample.velocities;
  take({.smoothing_s = 0});
  float largest = 0;
  for (std::size_t i = 0; i < blending.size(); ++i)
    largest = std::max(largest, std::abs(blending[i] - sample.velocities[i]));
  EXPECT_GT(largest, 0.5F) << "there was no correction";
}

TEST_F(SampleColumnsTest, HoweverBrieflyCorrectionsAreBlendedInNoSampleSpoilsTheNext) {
  join();
  core->start_sampling();
  play(10);
  const auto sound = [this](const SampleRequest& request) {
    take(request);
    for (const float place : sample.positions) ASSERT_TRUE(std::isfinite(place)) << request.smoothing_s;
    for (const float speed : sample.velocities) ASSERT_TRUE(std::isfinite(speed)) << request.smoothing_s;
  };
  for (const double smoothing_s : {1e-41, 1e-38, 1e-7, 1e-6, 1e-3}) {
    frame();
    sound({.smoothing_s = smoothing_s});
    sound({.smoothing_s = smoothing_s});  // the clock stands
    // Moments to and fro, while it does.
    for (int i = 0; i < 200; ++i) {
      sound({.at_ns = now_ns - 1000 * kMs, .smoothing_s = smoothing_s});
      sound({.at_ns = now_ns + 1000 * kMs, .smoothing_s = smoothing_s});
    }
  }
  play(30);
  sound({});
  const Taken smoothed = sample;
  sound({.smoothing_s = 0});
  for (std::size_t i = 0; i < sample.positions.size(); ++i)
    EXPECT_NEAR(smoothed.positions[i], sample.positions[i], 0.5);
}

}  // namespace
}  // namespace tandem::client
