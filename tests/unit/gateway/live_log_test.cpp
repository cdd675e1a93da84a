#include "services/gateway/viewing/live_log.hpp"

#include <gtest/gtest.h>

namespace tandem::gateway {
namespace {

OutgoingPtr message(std::size_t bytes) {
  transport::DeltaMessage delta;
  delta.payload.resize(bytes);
  return make_outgoing(delta);
}

TEST(LiveLog, HoldsNoMoreBytesThanItMay) {
  LiveLog log(10'000);
  for (int i = 0; i < 100; ++i) log.push_input(message(1000), 1, i);
  EXPECT_EQ(log.end(), 100U);
  EXPECT_LE(log.bytes_from(log.begin()), 10'000U);
  EXPECT_GE(log.bytes_from(log.begin()), 8'000U);
  EXPECT_EQ(log.bytes_from(log.end()), 0U);
  EXPECT_EQ(log.bytes_from(log.end() - 1), log.at(log.end() - 1)->size());
}

TEST(LiveLog, HoldsNothingForLongerThanItMay) {
  LiveLog log(10'000);
  log.push_input(message(1), 1, 0);
  log.push_input(message(1), 1, LiveLog::kLongestNs);
  EXPECT_EQ(log.begin(), 0U);
  log.push_input(message(1), 1, LiveLog::kLongestNs + 1);
  EXPECT_EQ(log.begin(), 1U);
}

TEST(LiveLog, KeepsTheNewestHoweverLargeItIs) {
  LiveLog log(100);
  log.push_input(message(10), 1, 0);
  log.push_input(message(5000), 1, 1);
  ASSERT_EQ(log.end() - log.begin(), 1U);
  EXPECT_GT(log.at(log.begin())->size(), 5000U);
}

TEST(LiveLog, PlacesOfBeforeAreNoneOfNow) {
  LiveLog log(100);
  log.push_input(message(1), 1, 0);
  const LiveLog::Place before = log.end() - 1;
  log.clear();
  EXPECT_EQ(log.begin(), log.end());
  log.push_input(message(1), 1, 1);
  EXPECT_LT(before, log.begin());
  EXPECT_EQ(log.bytes_from(log.begin()), log.at(log.begin())->size());
}

TEST(LiveLog, WhoHoldsOneOfTheFramesOfAMessageGetsItAgain) {
  LiveLog log(10'000);
  log.push_delta(message(1), 3, 0, 1);
  log.push_delta(message(0), 10, 0, 2, 6);
  log.push_delta(message(1), 11, 0, 3);
  EXPECT_EQ(log.after(3), log.begin() + 1);
  EXPECT_EQ(log.after(7), log.begin() + 1);
  EXPECT_EQ(log.after(10), log.begin() + 2);
  EXPECT_EQ(log.after(11), log.end());
  LiveLog another(10'000);
  another.push_delta(message(0), 10, 0, 2, 6);
  EXPECT_EQ(another.after(3), another.begin());
  EXPECT_FALSE(another.after(2));
}

/// Frames 3 to 6. Input 1 is counted by frame 3, input 2 by frame 5, input 3 by frame 6.
LiveLog some_frames(std::size_t most_bytes = 10'000) {
  LiveLog log(most_bytes);
  log.push_input(message(1), 1, 0);
  log.push_delta(message(1), 3, 1, 1);
  log.push_input(message(1), 2, 2);
  log.push_delta(message(1), 4, 1, 3);
  log.push_input(message(1), 3, 4);
  log.push_delta(message(1), 5, 2, 5);
  log.push_delta(message(1), 6, 3, 6);
  return log;
}

TEST(LiveLog, AViewerGoesOnBehindItsFrameAndGetsEveryInputThatItMayLack) {
  const LiveLog log = some_frames();
  EXPECT_EQ(log.after(6), log.end());
  EXPECT_EQ(log.after(5), LiveLog::Place{4}) << "input 3 came before frame 5, which does not count it";
  EXPECT_EQ(log.after(4), LiveLog::Place{2});
  EXPECT_EQ(log.after(3), LiveLog::Place{2});
  EXPECT_EQ(log.after(2), LiveLog::Place{0}) << "the log begins there";
  EXPECT_EQ(log.after(1), std::nullopt);
  EXPECT_EQ(log.after(7), std::nullopt);
  EXPECT_EQ(log.after(0), std::nullopt);
}

TEST(LiveLog, WhatWasDroppedCannotBeGoneOnFrom) {
  LiveLog log = some_frames();
  log.push_delta(message(1), 7, 3, LiveLog::kLongestNs + 2);
  EXPECT_EQ(log.begin(), 2U);
  EXPECT_EQ(log.after(2), std::nullopt);
  EXPECT_EQ(log.after(3), std::nullopt) << "an input that it lacks may have been dropped";
  EXPECT_EQ(log.after(4), LiveLog::Place{2});
  log.clear();
  EXPECT_EQ(log.after(4), std::nullopt);
  log.push_delta(message(1), 40, 3, LiveLog::kLongestNs + 3);
  EXPECT_EQ(log.after(39), log.begin());
}

}  // namespace
}  // namespace tandem::gateway
