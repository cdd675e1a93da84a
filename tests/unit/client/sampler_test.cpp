#include <cmath>

#include "sdk/wire/frame_bundle.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

class SamplerTest : public ClientTest {
 protected:
  Sample& take(SampleMode mode) {
    core->start_sampling();
    EXPECT_TRUE(core->sample(sample, mode, {now_ns, wall_ns()}));
    return sample;
  }
  [[nodiscard]] double agreed_x(Slot slot) const {
    return core->timeline()->state(core->timeline()->applied()).p(0)[slot] * server.session.lattice_unit;
  }
  Sample sample;
};

TEST_F(SamplerTest, BeforeTheFirstSnapshotThereIsNothingToDraw) {
  start();
  core->start_sampling();
  poll();
  EXPECT_FALSE(core->sample(sample, SampleMode::kExtrapolate, {now_ns, wall_ns()}));
}

TEST_F(SamplerTest, NeverTouchesTheClientState) {
  join();
  for (int i = 0; i < 100; ++i) {
    frame();
    take(i % 2 == 0 ? SampleMode::kInterpolate : SampleMode::kExtrapolate);
  }
  EXPECT_EQ(core->timeline()->applied(), 101U);
  expect_agreed();
}

TEST_F(SamplerTest, InterpolationGoesFromOneAgreedFrameToTheNext) {
  join();
  for (int i = 0; i < 30; ++i) {
    frame();
    take(SampleMode::kInterpolate);
  }
  const double from = agreed_x(5);
  frame();
  const double to = agreed_x(5);
  double last_share = -1;
  for (int i = 0; i < 8; ++i) {
    const Sample& s = take(SampleMode::kInterpolate);
    const double share = s.frame - (static_cast<double>(core->timeline()->applied()) - 1);
    EXPECT_GE(share, last_share);
    EXPECT_NEAR(s.positions[15], from + (to - from) * share, 1e-5);
    last_share = share;
    poll(4 * kMs);
  }
  EXPECT_GT(last_share, 0.7);
}

TEST_F(SamplerTest, ExtrapolationFollowsTheServersClockBetweenFrames) {
  join();
  for (int i = 0; i < 30; ++i) {
    frame();
    take(SampleMode::kExtrapolate);
  }
  double last = sample.frame;
  for (int i = 0; i < 4; ++i) {
    poll(8 * kMs);
    take(SampleMode::kExtrapolate);
    EXPECT_NEAR(sample.frame - last, 8.0 / 33.3333, 0.01);
    last = sample.frame;
  }
}

// Six frames a message, 200 ms apart; polls and samples every 8 ms and in between.
TEST_F(SamplerTest, FramesThatShareAMessageAreDrawnEvenlyAndLateByTheDelay) {
  for (const bool own : {false, true})
    for (const SampleMode mode : {SampleMode::kExtrapolate, SampleMode::kInterpolate}) {
      SCOPED_TRACE(mode == SampleMode::kExtrapolate ? "extrapolated" : "interpolated");
      SCOPED_TRACE(own ? "by a gateway" : "by the server");
      core.reset();
      server = FakeServer(1000 + static_cast<Epoch>(mode) + (own ? 10 : 0));
      server.session.streams[0].delay_ms = own ? 50 : 200;
      max_delay_ms = own ? 249 : 0;
      port.collects_frames = own;
      join();
      ASSERT_FALSE(port.acks.empty());
      EXPECT_EQ(port.acks.back().max_delay_ms, max_delay_ms);
      const std::int64_t began_ns = now_ns;
      const Frame first = server.frame();
      double last = 0;
      std::size_t most_at_once = 0;
      for (int message = 0; message < 20; ++message) {
        transport::FrameBundle bundle;
        for (int i = 0; i < 6; ++i) {
          const auto delta = server.advance();
          bundle.add(delta.frame, delta.hash, delta.payload);
        }
        const std::int64_t made_ns = began_ns + static_cast<std::int64_t>(server.frame() - first) * kFrameNs;
        while (now_ns < made_ns) {
          const std::size_t before = recorder.applied.size();
          poll(std::min(8 * kMs, made_ns - now_ns));
          if (message < 5) continue;  // until then it has estimated the clock
          most_at_once = std::max(most_at_once, recorder.applied.size() - before);
          const double drawn = take(mode).frame;
          if (last > 0) {
            EXPECT_LT(drawn - last, 0.4);
          }
          EXPECT_GE(drawn, last);
          last = drawn;
          const double made = static_cast<double>(first) + static_cast<double>(now_ns - began_ns) / kFrameNs;
          EXPECT_NEAR(made - drawn, 6, mode == SampleMode::kExtrapolate ? 0.5 : 1.5);
        }
        auto delta = bundle.take();
        delta.epoch = server.session.epoch;
        delta.server_time_ns = wall_ns();
        deliver(std::move(delta));
        take(mode);
      }
      EXPECT_EQ(most_at_once, 1U);
      EXPECT_LT(figures().smoothed_latency_ns, 10.0 * kMs) << "the delay is no lag";
      expect_agreed();
      recorder.applied.clear();
      recorder.hashes.clear();
    }
}

TEST_F(SamplerTest, WhenTheServerHaltsThePictureHaltsToo) {
  join();
  for (int i = 0; i < 30; ++i) frame();
  take(SampleMode::kExtrapolate);
  for (int i = 0; i < 100; ++i) {
    poll(20 * kMs);
    take(SampleMode::kExtrapolate);
  }
  // 0.1 s at full speed, and what is left of 0.25 s of slowing down.
  EXPECT_NEAR(sample.frame, static_cast<double>(core->timeline()->now()) + 3 + 7.5 / 2, 1e-6);
  const float settled = sample.positions[0];
  poll(500 * kMs);
  take(SampleMode::kExtrapolate);
  EXPECT_NEAR(sample.positions[0], settled, 1e-5);
}

TEST_F(SamplerTest, ACorrectionIsBlendedInOverATenthOfASecond) {
  join();
  for (int i = 0; i < 30; ++i) {
    frame();
    take(SampleMode::kExtrapolate);
  }
  // Sampled at 120 Hz, nothing jumps by as much as the corrections (up to 1.5 units of a thousand lattice
  // units).
  float largest = 0;
  std::vector<float> before = sample.positions;
  for (int i = 0; i < 200; ++i) {
    if (i % 4 == 3) {
      frame(kFrameNs / 4);
    } else {
      poll(kFrameNs / 4);
    }
    take(SampleMode::kExtrapolate);
    for (std::size_t at = 0; at < before.size(); ++at) {
      largest = std::max(largest, std::abs(sample.positions[at] - before[at]));
    }
    before = sample.positions;
  }
  EXPECT_LT(largest, 0.5F);
  EXPECT_GT(largest, 0.01F);
}

TEST_F(SamplerTest, NewGoneAndJumpedBodiesAreTold) {
  join();
  take(SampleMode::kExtrapolate);
  EXPECT_EQ(sample.changes[3], BodyChange::kNew);
  frame();
  take(SampleMode::kExtrapolate);
  EXPECT_EQ(sample.changes[3], BodyChange::kNone);
  server.teleport(3);
  frame();
  take(SampleMode::kExtrapolate);
  EXPECT_EQ(sample.changes[3], BodyChange::kJumped);
  EXPECT_EQ(sample.changes[4], BodyChange::kNone);
  EXPECT_NEAR(sample.positions[9], 900, 1);  // at once, not blended
  frame();
  take(SampleMode::kExtrapolate);
  EXPECT_EQ(sample.changes[3], BodyChange::kNone);
}

TEST_F(SamplerTest, NothingIsInterpolatedAcrossATeleport) {
  join();
  for (int i = 0; i < 30; ++i) {
    frame();
    take(SampleMode::kInterpolate);
  }
  server.teleport(3);
  frame();
  for (int i = 0; i < 8; ++i) {
    take(SampleMode::kInterpolate);
    EXPECT_NEAR(sample.positions[9], 900, 0.001);
    poll(4 * kMs);
  }
}

TEST_F(SamplerTest, ATeleportBetweenTwoSamplesIsNotForgotten) {
  join();
  frame();
  take(SampleMode::kExtrapolate);
  server.teleport(3);
  frame();
  frame();
  frame();
  take(SampleMode::kExtrapolate);
  EXPECT_EQ(sample.changes[3], BodyChange::kJumped);
}

TEST_F(SamplerTest, AfterARejoinEverythingMayHaveJumped) {
  join();
  take(SampleMode::kExtrapolate);
  static_cast<void>(server.advance());
  frame();
  ASSERT_EQ(core->phase(), ClientPhase::kJoining);
  poll(200 * kMs);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  take(SampleMode::kExtrapolate);
  EXPECT_EQ(sample.changes[3], BodyChange::kJumped);
}

}  // namespace
}  // namespace tandem::client
