// An app's own gravity, shown before it acts.

#include <algorithm>
#include <cmath>

#include "tests/support/client/fake_server.hpp"
#include "tests/support/client/taken.hpp"

namespace tandem::client {
namespace {

class EchoTest : public ClientTest {
 protected:
  static constexpr double kFrameS = kFrameNs * 1e-9;
  /// The fake server's gravity, -20, as scene units / s^2: see LocalEcho.
  static constexpr double kUnit = 0.001 / 64 / (kFrameS * kFrameS);

  void play() {
    echo = true;
    join();
    core->start_sampling();
    server.undisturbed = true;
    for (int i = 0; i < 40; ++i) {
      frame();
      take();
    }
  }
  Taken& take() {
    const auto taken = core->sample({}, sample.make_room(40), {now_ns, wall_ns()});
    EXPECT_TRUE(taken.has_value());
    if (taken) static_cast<SampledFrame&>(sample) = *taken;
    return sample;
  }
  std::uint64_t send(double gravity) {
    const auto sent = core->send(transport::InputKind::kGravity, {gravity * kUnit, -20 * kUnit, 0}, {},
                                 {now_ns, wall_ns()});
    EXPECT_TRUE(sent.has_value());
    return sent.value_or(0);
  }
  /// A frame of the server in `steps` polls, each sampled; the delta comes with the last.
  void sampled_frame(int steps = 5) {
    for (int i = 1; i < steps; ++i) {
      poll(kFrameNs / steps);
      look();
    }
    frame(kFrameNs / steps);
    look();
  }
  /// Keeps the largest second difference of any body's place.
  void look() {
    take();
    if (last_.size() == sample.positions.size() && before_last_.size() == last_.size()) {
      for (std::size_t i = 0; i < last_.size(); ++i)
        largest = std::max(largest, std::abs(sample.positions[i] - 2 * last_[i] + before_last_[i]));
    }
    before_last_ = std::exchange(last_, sample.positions);
  }
  transport::ScheduledInputMessage scheduled(std::uint64_t number, std::int32_t gravity_x) {
    auto message = server.schedule(-20, gravity_x);
    message.source_client = kClient;
    message.source_number = number;
    return message;
  }

  Taken sample;
  float largest = 0;

 private:
  std::vector<float> last_, before_last_;
};

TEST_F(EchoTest, ItShowsAtOnceAndGrowsAsAFallDoes) {
  play();
  take();
  const double from = sample.positions[0];
  const double speed = sample.velocities[0];
  send(-400);
  poll(50 * kMs);
  take();
  const double expected = from + speed * 0.05 - 0.5 * 400 * kUnit * 0.05 * 0.05;
  EXPECT_NEAR(sample.positions[0], expected, 1e-3);
  EXPECT_NEAR(sample.velocities[0], speed - 400 * kUnit * 0.05, 0.05);
  expect_agreed();
}

TEST_F(EchoTest, WithoutTheOptionNothingShows) {
  play();
  const double from = take().positions[0];
  const double speed = sample.velocities[0];
  echo = false;
  core->send(transport::InputKind::kPush, {0, 0, 0, 1, 50, 0, 0}, {}, {now_ns, wall_ns()}).value();
  poll(50 * kMs);
  EXPECT_NEAR(take().positions[0], from + speed * 0.05, 1e-3);
}

TEST_F(EchoTest, TheAgreedMotionTakesItOverWithoutAJump) {
  play();
  for (int i = 0; i < 5; ++i) sampled_frame();
  const float before = std::exchange(largest, 0.0F);
  // The place goes on from where it is; its velocity may change by what the echo gave it in four frames.
  const double bend = 400 * kUnit * 4 * kFrameS * (kFrameS / 5);
  const std::uint64_t number = send(-400);
  sampled_frame();
  port.inputs.push_back(from_server(scheduled(number, -400)));
  for (int i = 0; i < 12; ++i) sampled_frame();
  EXPECT_LT(largest, before + bend);
  // And it ends where the session has it.
  for (int i = 0; i < 60; ++i) sampled_frame();
  const State& state = core->timeline()->state(core->timeline()->applied());
  EXPECT_NEAR(sample.positions[0], state.p(0)[0] * 0.001, 0.05);
  expect_agreed();
}

TEST_F(EchoTest, WhatIsRefusedGoesAwayAgain) {
  play();
  const std::uint64_t number = send(-400);
  sampled_frame();
  transport::ReplyMessage reply;
  reply.client = kClient;
  reply.epoch = server.session.epoch;
  reply.highest_input = number;
  reply.entries = {{number, 0, static_cast<std::uint32_t>(transport::Reason::kInvalid)}};
  port.replies.push_back(from_server(reply));
  for (int i = 0; i < 60; ++i) sampled_frame();
  const State& state = core->timeline()->state(core->timeline()->applied());
  EXPECT_NEAR(sample.positions[0], state.p(0)[0] * 0.001, 1e-2);
}

TEST_F(EchoTest, AnAnswerThatNeverComesLeavesABoundedOffset) {
  play();
  send(-400);
  for (int i = 0; i < 200; ++i) sampled_frame(2);
  const State& state = core->timeline()->state(core->timeline()->applied());
  const double most = 0.5 * 400 * kUnit * 0.25 * 0.25;
  EXPECT_NEAR(sample.positions[0], state.p(0)[0] * 0.001 - most, 0.05 * most + 1e-2);
}

}  // namespace
}  // namespace tandem::client
