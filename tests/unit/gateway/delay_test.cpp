// Viewers that let their frames wait, so that several share a message.

#include "fake_world.hpp"
#include "sdk/wire/frame_bundle.hpp"
#include "services/gateway/viewing/grouping.hpp"

namespace tandem::gateway {
namespace {

using transport::DeltaMessage;
using transport::Phase;

class DelayTest : public GatewayTest {
 protected:
  static constexpr std::int64_t kPeriodNs = 20 * kMillisecond;

  explicit DelayTest(Limits limits = {}) : GatewayTest(limits) {
    auto session = fake_session();
    session.frame_rate_hz = 50;
    gateway.on_session(session);
    next();
  }
  /// A frame that tells its number by its payload and its hash.
  void next(std::size_t bytes = 20) {
    now_ns += kPeriodNs;
    client::CompleteDelta delta;
    delta.frame = ++world.frame;
    delta.last_input = world.last_input;
    delta.hash = 1000 + delta.frame;
    delta.server_time_ns = now_ns;
    delta.payload.resize(bytes, static_cast<std::byte>(delta.frame));
    gateway.on_applied(delta, now_ns);
    if (happens) gateway.on_happened({}, now_ns);
    gateway.poll(now_ns);
  }
  void scheduled() {
    transport::ScheduledInputMessage input;
    input.epoch = kEpoch;
    input.number = ++world.last_input;
    input.frame = world.frame + 1;
    gateway.on_scheduled(input, now_ns);
  }
  ViewerId join_with_delay(transport::ClientId client, std::uint32_t delay_ms) {
    const ViewerId id = join(client);
    wants(id, client, delay_ms);
    return id;
  }
  void wants(ViewerId id, transport::ClientId client, std::uint32_t delay_ms) {
    auto message = ack(client, Phase::kPlaying);
    message.applied = world.frame;
    message.max_delay_ms = delay_ms;
    EXPECT_FALSE(say(id, message));
  }
  /// How many frames each delta tells that a viewer gets now; checks that they follow what it holds, with
  /// hashes and payloads.
  std::vector<std::size_t> told(ViewerId id) {
    std::vector<std::size_t> out;
    for (const auto& delta : only<DeltaMessage>(read(id))) {
      std::size_t frames = 0;
      for (const auto& run : transport::read_frames(delta)) {
        Frame& held = held_[id];
        EXPECT_TRUE(held == 0 || held + 1 == run.last - run.before) << held << ' ' << run.last;
        held = run.last;
        frames += run.before + 1;
        EXPECT_EQ(run.hash, 1000 + run.last);
        if (!run.payload.empty()) {
          EXPECT_EQ(run.payload.back(), static_cast<std::byte>(run.last));
        }
      }
      EXPECT_EQ(frames, delta.earlier + 1);
      EXPECT_GT(frames, 0U);
      out.push_back(frames);
    }
    return out;
  }
  std::map<ViewerId, Frame> held_;
  bool happens = false;  // an event on each frame
};

TEST_F(DelayTest, FramesShareAMessageAndNobodyElseWaits) {
  const ViewerId at_once = join(1), waits = join_with_delay(2, 200);
  std::vector<std::size_t> of_waits;
  for (int i = 0; i < 30; ++i) {
    next();
    EXPECT_EQ(told(at_once), (std::vector<std::size_t>{1}));
    for (const std::size_t frames : told(waits)) of_waits.push_back(frames);
  }
  EXPECT_EQ(of_waits, (std::vector<std::size_t>{11, 11})) << "the first waits for 0.2 s";
}

TEST_F(DelayTest, LeaveWhenTheDelayIsOverIfNoFrameComes) {
  const ViewerId id = join_with_delay(1, 200);
  next();
  now_ns += 190 * kMillisecond;
  EXPECT_EQ(gateway.poll(now_ns), now_ns + 10 * kMillisecond);
  EXPECT_TRUE(told(id).empty());
  EXPECT_FALSE(gateway.any_ready(now_ns));
  later(10 * kMillisecond);
  EXPECT_TRUE(gateway.any_ready(now_ns));
  EXPECT_EQ(told(id), (std::vector<std::size_t>{1}));
}

TEST_F(DelayTest, AMessageIsNoLargerThanAPacket) {
  const ViewerId id = join_with_delay(1, 1000);
  for (int i = 0; i < 6; ++i) next(300);
  EXPECT_EQ(told(id), (std::vector<std::size_t>{4}));
  next(5000);
  EXPECT_EQ(told(id), (std::vector<std::size_t>{2, 1}));
}

TEST_F(DelayTest, ThoseOfADelayShareEveryMessage) {
  const ViewerId a = join_with_delay(1, 149), b = join_with_delay(2, 100);
  for (int i = 0; i < 6; ++i) next();
  const auto of_a = gateway.next(a, now_ns), of_b = gateway.next(b, now_ns);
  ASSERT_NE(of_a.message, nullptr);
  EXPECT_EQ(of_a.message, of_b.message);
}

TEST_F(DelayTest, AnEventEndsTheWaitingTenTimesASecondAtMost) {
  const ViewerId id = join_with_delay(1, 500);
  next();
  next();
  EXPECT_TRUE(told(id).empty());
  happens = true;
  next();
  EXPECT_EQ(told(id), (std::vector<std::size_t>{3}));
  for (int i = 0; i < 4; ++i) next();
  EXPECT_TRUE(told(id).empty());
  next();
  EXPECT_EQ(told(id), (std::vector<std::size_t>{5}));
}

TEST_F(DelayTest, AnInputOfItsOwnEndsTheWaiting) {
  const ViewerId acts = join_with_delay(1, 500), watches = join_with_delay(2, 500);
  EXPECT_FALSE(say(acts, input(1, 1, {0, 0, 0, 1, 1, 0, 0})));
  next();
  next();
  EXPECT_TRUE(told(acts).empty());
  gateway.on_outcome({client::InputOutcome::Kind::kActed, world.sent.size(), world.frame, 0, 0}, now_ns);
  gateway.poll(now_ns);
  EXPECT_EQ(told(acts), (std::vector<std::size_t>{2}));
  EXPECT_TRUE(told(watches).empty());
  for (int i = 0; i < 30; ++i) next();
  EXPECT_FALSE(told(acts).empty());
  EXPECT_FALSE(told(watches).empty());
}

TEST_F(DelayTest, AScheduledInputWaitsForNothingAndKeepsItsPlace) {
  const ViewerId id = join_with_delay(1, 500);
  next();
  next();
  scheduled();
  EXPECT_TRUE(read(id).empty());
  next();
  std::vector<Frame> order;
  for (const auto& message : read(id)) {
    if (const auto* delta = std::get_if<DeltaMessage>(&message)) order.push_back(delta->frame);
    if (std::holds_alternative<transport::ScheduledInputMessage>(message)) order.push_back(0);
  }
  EXPECT_EQ(order, (std::vector<Frame>{world.frame - 1, 0, world.frame}));
  scheduled();
  next();
  EXPECT_TRUE(read(id).empty()) << "one who tilts on and on would undo it for all";
}

TEST_F(DelayTest, WhatTheServerCollectedIsNotHeldBackAgain) {
  const ViewerId id = join_with_delay(1, 200);
  now_ns += 10 * kPeriodNs;
  for (std::uint32_t left = 10; left-- > 0;) {
    client::CompleteDelta delta;
    delta.frame = ++world.frame;
    delta.hash = 1000 + delta.frame;
    delta.payload.resize(20, static_cast<std::byte>(delta.frame));
    delta.more = left;
    gateway.on_applied(delta, now_ns);
    gateway.poll(now_ns);
  }
  EXPECT_EQ(told(id), (std::vector<std::size_t>{10}));
}

TEST_F(DelayTest, OneThatFlipsItsDelayChangesItSeldom) {
  const ViewerId flips = join_with_delay(1, 200), other = join(2);
  std::size_t messages = 0;
  for (int i = 0; i < 500; ++i) {  // 10 s, five flips in a tenth
    wants(flips, 1, i % 2 == 0 ? 0 : 200);
    next();
    messages += told(flips).size();
    EXPECT_EQ(told(other), (std::vector<std::size_t>{1}));
  }
  EXPECT_GE(messages, 10U);
  // What it said last holds in the end.
  wants(flips, 1, 500);
  later(Viewer::kDelayKeptNs);
  told(flips);
  for (int i = 0; i < 25; ++i) {
    next();
    EXPECT_TRUE(told(flips).empty()) << i;
  }
  next();
  EXPECT_EQ(told(flips), (std::vector<std::size_t>{26}));
  EXPECT_EQ(held_[flips], world.frame);
}

TEST_F(DelayTest, AnHourIsRefusedByName) {
  const ViewerId id = join(1), other = join(2);
  auto message = ack(1, Phase::kPlaying);
  message.max_delay_ms = 1001;
  EXPECT_EQ(say(id, message), Refusal::kMalformed);
  message.max_delay_ms = 3'600'000;
  EXPECT_EQ(say(id, message), Refusal::kMalformed);
  next();
  EXPECT_EQ(told(other), (std::vector<std::size_t>{1}));
}

TEST_F(DelayTest, TheDelayDoesNotMakeItSlow) {
  const ViewerId id = join_with_delay(1, 1000);
  world.snapshot.resize(10);
  for (int i = 0; i < 200; ++i) {
    next(10);
    told(id);
  }
  EXPECT_EQ(gateway.counts().skips, 0U);
}

TEST_F(DelayTest, AnotherSessionBeginsAnew) {
  const ViewerId id = join_with_delay(1, 500);
  next();
  gateway.on_session(fake_session(kEpoch + 1));
  later(kSecond);
  EXPECT_TRUE(only<DeltaMessage>(read(id)).empty());
}

}  // namespace
}  // namespace tandem::gateway
