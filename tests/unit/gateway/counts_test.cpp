#include "services/gateway/counts.hpp"

#include <gtest/gtest.h>

namespace tandem::gateway {
namespace {

TEST(CountLog, SaysWhatChangedOnceAMinute) {
  CountLog log;
  Counts counts;
  EXPECT_FALSE(log.line(counts, 0, 0)) << "nothing did";
  counts.joined = 2;
  counts.of(Refusal::kToken) = 3;
  EXPECT_EQ(log.line(counts, 1, kSecond), "1 viewers, 2 came, 3 refused: token missing or wrong");
  counts.of(Refusal::kToken) = 1'000'000;
  EXPECT_FALSE(log.line(counts, 1, 60 * kSecond));
  EXPECT_EQ(log.line(counts, 1, 61 * kSecond), "1 viewers, 999997 refused: token missing or wrong");
  EXPECT_FALSE(log.line(counts, 1, 200 * kSecond)) << "nothing did";
}

}  // namespace
}  // namespace tandem::gateway
