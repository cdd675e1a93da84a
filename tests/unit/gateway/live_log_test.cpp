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
  for (int i = 0; i < 100; ++i) log.push(message(1000), i);
  EXPECT_EQ(log.end(), 100U);
  EXPECT_LE(log.bytes_from(log.begin()), 10'000U);
  EXPECT_GE(log.bytes_from(log.begin()), 8'000U);
  EXPECT_EQ(log.bytes_from(log.end()), 0U);
  EXPECT_EQ(log.bytes_from(log.end() - 1), log.at(log.end() - 1)->size());
}

TEST(LiveLog, HoldsNothingForLongerThanItMay) {
  LiveLog log(10'000);
  log.push(message(1), 0);
  log.push(message(1), LiveLog::kLongestNs);
  EXPECT_EQ(log.begin(), 0U);
  log.push(message(1), LiveLog::kLongestNs + 1);
  EXPECT_EQ(log.begin(), 1U);
}

TEST(LiveLog, KeepsTheNewestHoweverLargeItIs) {
  LiveLog log(100);
  log.push(message(10), 0);
  log.push(message(5000), 1);
  ASSERT_EQ(log.end() - log.begin(), 1U);
  EXPECT_GT(log.at(log.begin())->size(), 5000U);
}

TEST(LiveLog, PlacesOfBeforeAreNoneOfNow) {
  LiveLog log(100);
  log.push(message(1), 0);
  const LiveLog::Place before = log.end() - 1;
  log.clear();
  EXPECT_EQ(log.begin(), log.end());
  log.push(message(1), 1);
  EXPECT_LT(before, log.begin());
  EXPECT_EQ(log.bytes_from(log.begin()), log.at(log.begin())->size());
}

}  // namespace
}  // namespace tandem::gateway
