// Sampling beside the thread that applies. What must not wait is shown by a deadlock if it did, not by
// timing.
#include <atomic>
#include <thread>

#include "sdk/client/drawing/picture.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

class ConcurrentSampling : public ClientTest {
 protected:
  /// Interpolates at a moment when the last agreed frame has long arrived: nothing but that frame is drawn.
  [[nodiscard]] bool take_last(Sample& out) {
    constexpr std::int64_t kHourNs = 3'600'000'000'000;
    return core->sample(out, SampleMode::kInterpolate, {kStartNs + kHourNs, 0});
  }
  static constexpr std::int64_t kStartNs = 1'000'000'000'000;
};

TEST_F(ConcurrentSampling, BeforeItIsStartedNothingIsDrawn) {
  join();
  for (int i = 0; i < 5; ++i) frame();
  Sample sample;
  EXPECT_FALSE(take_last(sample));
  core->start_sampling();
  EXPECT_TRUE(take_last(sample));
  EXPECT_EQ(sample.frame, 6.0);
}

TEST_F(ConcurrentSampling, ASampleIsTakenWhileAFrameIsBeingApplied) {
  join();
  core->start_sampling();
  for (int i = 0; i < 5; ++i) frame();
  int taken = 0;
  recorder.in_apply = [&] {
    std::thread other([&] {
      Sample sample;
      if (take_last(sample)) ++taken;
    });
    other.join();  // poll() goes on only when the sample is there
  };
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(taken, 5);
}

TEST_F(ConcurrentSampling, FramesAreAppliedWhileASampleIsBeingTaken) {
  PictureExchange exchange;
  const auto show = [&exchange](Frame number) {
    Picture picture{.pacer = Pacer(30)};
    DrawnFrame& drawn = exchange.unused(picture);
    drawn.frame = number;
    picture.before = picture.agreed = picture.ahead = &drawn;
    exchange.show(picture);
  };
  show(1);
  {
    const PictureExchange::Reading reading(exchange);
    for (Frame number = 2; number < 100; ++number) show(number);
    ASSERT_NE(reading.picture(), nullptr);
    EXPECT_EQ(reading.picture()->agreed->frame, 1U);
  }
  EXPECT_EQ(PictureExchange::Reading(exchange).picture()->agreed->frame, 99U);
  exchange.clear();
  EXPECT_EQ(PictureExchange::Reading(exchange).picture(), nullptr);
}

TEST_F(ConcurrentSampling, EverySampleShowsOneFrameWhole) {
  join();
  core->start_sampling();
  // Both threads may draw in either mode; the positions of a frame are checked where a frame alone is drawn.
  std::map<Frame, std::vector<float>> agreed;
  const auto remember = [&] {
    const State& state = core->timeline()->state(core->timeline()->applied());
    std::vector<float>& positions = agreed[core->timeline()->applied()];
    for (Slot slot = 0; slot < state.capacity(); ++slot) {
      for (const std::int32_t p : state.body(slot).p) {
        positions.push_back(static_cast<float>(p) * static_cast<float>(server.session.lattice_unit));
      }
    }
  };
  remember();
  recorder.in_apply = [&] {
    remember();
    std::this_thread::yield();
  };
  std::atomic<bool> ending = false;
  std::vector<Sample> taken;
  std::thread other([&] {
    Sample sample;
    while (!ending) {
      EXPECT_TRUE(take_last(sample));
      if (taken.empty() || taken.back().frame != sample.frame) taken.push_back(sample);
    }
  });
  std::thread another([&] {
    Sample sample;
    while (!ending) {
      EXPECT_TRUE(core->sample(sample, SampleMode::kExtrapolate, {kStartNs, 0}));
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < 200; ++i) {
    if (i % 50 == 10) server.teleport(3);
    frame();
    poll(kFrameNs);  // simulates ahead
  }
  ending = true;
  other.join();
  another.join();
  for (const Sample& sample : taken) {
    const auto found = agreed.find(static_cast<Frame>(sample.frame));
    ASSERT_NE(found, agreed.end()) << "frame " << sample.frame;
    EXPECT_EQ(sample.positions, found->second) << "frame " << sample.frame;
  }
}

}  // namespace
}  // namespace tandem::client
