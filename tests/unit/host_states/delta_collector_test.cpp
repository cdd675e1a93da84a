#include "services/host/outgoing/delta_collector.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tandem::host {
namespace {

constexpr std::int64_t kPeriod = 33 * kMillisecond;

// Each delta that left as "frame-earlier", with the time since the frame was made where there is one.
class DeltaCollectorTest : public testing::Test {
 protected:
  void collect_with(DeltaCollector::Limits limits) {
    limits.period_ns = kPeriod;
    collector_ = DeltaCollector(limits);
    EXPECT_EQ(make(1, 1, 20, kSecond), "1-0 ") << "the first frame waits for no others";
  }
  std::string make(Frame frame, std::uint64_t hash, std::size_t bytes, std::int64_t now_ns,
                   std::uint64_t last_input = 0, bool at_once = false) {
    const std::vector<std::byte> payload(bytes);
    collector_.take({.frame = frame,
                     .hash = hash,
                     .last_input = last_input,
                     .wall_ns = 5000 + static_cast<std::int64_t>(frame),
                     .payload = payload,
                     .at_once = at_once},
                    now_ns, left_);
    return told();
  }
  std::string release(bool all, std::int64_t now_ns) {
    collector_.release(all, now_ns, left_);
    return told();
  }
  std::string told() {
    std::string text;
    for (const transport::DeltaMessage& delta : left_) {
      text += std::to_string(delta.frame) + "-" + std::to_string(delta.earlier) + " ";
      EXPECT_EQ(delta.server_time_ns, 5000 + static_cast<std::int64_t>(delta.frame));
      EXPECT_FALSE(transport::read_frames(delta).empty());
      largest_ = std::max(largest_, delta.payload.size());
    }
    left_.clear();
    return text;
  }
  DeltaCollector collector_{{.frames = 101}};
  std::vector<transport::DeltaMessage> left_;
  std::size_t largest_ = 0;
};

TEST_F(DeltaCollectorTest, QuietFramesAreToldOnceASecond) {
  EXPECT_EQ(make(1, 9, 0, kSecond), "1-0 ") << "nothing is known of the frame before";
  for (Frame frame = 2; frame <= 60; ++frame)
    EXPECT_EQ(make(frame, 9, 0, kSecond + static_cast<std::int64_t>(frame - 1) * kSecond / 60), "");
  EXPECT_EQ(make(61, 9, 0, 2 * kSecond), "61-59 ");
}

TEST_F(DeltaCollectorTest, QuietFramesAreToldWithWhatEndsThem) {
  make(1, 9, 0, kSecond);
  EXPECT_EQ(make(2, 9, 0, kSecond + 1), "");
  EXPECT_EQ(make(3, 9, 0, kSecond + 2), "");
  EXPECT_EQ(make(4, 8, 12, kSecond + 3), "4-2 ");
  EXPECT_EQ(make(5, 7, 0, kSecond + 4), "5-0 ") << "bodies move without a correction: the state is another";
  EXPECT_EQ(make(6, 7, 0, kSecond + 5), "");
  EXPECT_EQ(make(7, 7, 0, kSecond + 6, 1), "6-0 7-0 ") << "a scheduled input was issued";
}

TEST_F(DeltaCollectorTest, QuietFramesHaveALimit) {
  make(1, 9, 0, kSecond);
  for (Frame frame = 2; frame <= 101; ++frame) EXPECT_EQ(make(frame, 9, 0, kSecond), "");
  EXPECT_EQ(make(102, 9, 0, kSecond), "102-100 ");
}

TEST_F(DeltaCollectorTest, FramesAreForgottenWithAStreamThatIsNotMade) {
  make(1, 9, 0, kSecond);
  EXPECT_EQ(make(2, 9, 0, kSecond), "");
  EXPECT_EQ(make(7, 9, 0, kSecond), "7-0 ");
  EXPECT_EQ(make(8, 9, 0, kSecond), "");
}

TEST_F(DeltaCollectorTest, WithoutADelayNothingThatMovesWaits) {
  for (Frame frame = 1; frame <= 30; ++frame)
    EXPECT_EQ(make(frame, frame, 20, kSecond + static_cast<std::int64_t>(frame) * kPeriod),
              std::to_string(frame) + "-0 ");
}

TEST_F(DeltaCollectorTest, SmallFramesShareADeltaAndNoneWaitsForLongerThanTheDelay) {
  collect_with({.frames = 101, .delay_ns = 200 * kMillisecond});
  std::string all;
  for (Frame frame = 2; frame <= 22; ++frame)
    all += make(frame, frame, 20, kSecond + static_cast<std::int64_t>(frame) * kPeriod);
  EXPECT_EQ(all, "8-6 15-6 22-6 ") << "the first of seven waits for six periods, 198 ms";
}

TEST_F(DeltaCollectorTest, ADeltaOfSeveralFramesFitsAPacket) {
  collect_with({.frames = 101, .delay_ns = kSecond});
  std::string all;
  for (Frame frame = 2; frame <= 13; ++frame) all += make(frame, frame, 300, kSecond);
  EXPECT_EQ(all, "5-3 9-3 13-3 ");
  EXPECT_EQ(make(14, 14, 900, kSecond), "14-0 ") << "one of half its size could not follow";
  EXPECT_EQ(make(15, 15, 700, kSecond), "");
  EXPECT_EQ(make(16, 16, 600, kSecond), "15-0 ") << "it might have fitted";
  EXPECT_EQ(release(true, kSecond), "16-0 ");
  EXPECT_EQ(make(17, 17, 20, kSecond), "");
  EXPECT_EQ(make(18, 18, 100'000, kSecond), "17-0 18-0 ") << "a large one leaves alone";
  EXPECT_EQ(largest_, 100'000U);
}

TEST_F(DeltaCollectorTest, WhatMayNotWaitTakesAlongWhatWaits) {
  collect_with({.frames = 101, .delay_ns = kSecond});
  EXPECT_EQ(make(2, 2, 20, kSecond), "");
  EXPECT_EQ(make(3, 3, 20, kSecond, 0, true), "3-1 ");
  EXPECT_EQ(make(4, 4, 20, kSecond), "");
  EXPECT_EQ(make(5, 5, 20, kSecond, 1), "4-0 ") << "all frames of a delta count the same inputs";
}

TEST_F(DeltaCollectorTest, FramesLeaveWhenNoOthersCome) {
  collect_with({.frames = 101, .delay_ns = 200 * kMillisecond});
  EXPECT_EQ(make(2, 2, 20, kSecond), "");
  EXPECT_EQ(release(false, kSecond + 199 * kMillisecond), "");
  EXPECT_EQ(release(false, kSecond + 200 * kMillisecond), "2-0 ") << "the session is suspended";
  EXPECT_EQ(make(3, 3, 20, kSecond + 300 * kMillisecond), "");
  EXPECT_EQ(release(true, kSecond + 300 * kMillisecond), "3-0 ") << "it ends";
  EXPECT_EQ(release(true, 2 * kSecond), "");
}

}  // namespace
}  // namespace tandem::host
