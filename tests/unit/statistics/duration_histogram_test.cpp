#include "sdk/statistics/duration_histogram.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace tandem {
namespace {

TEST(DurationHistogram, IsWithinTwoPerCentFromAMicrosecondToAHundredSeconds) {
  for (double ns = 1e3; ns < 1.001e11; ns *= 1.003) {
    DurationHistogram one;
    one.add(static_cast<std::int64_t>(ns));
    EXPECT_NEAR(one.quantile_ms(0.5), ns * 1e-6, 0.02 * ns * 1e-6);
  }
}

TEST(DurationHistogram, TellsTheQuantilesOfManyDurations) {
  DurationHistogram durations;
  for (std::int64_t i = 1; i <= 1000; ++i) durations.add(i * 10'000);
  EXPECT_NEAR(durations.quantile_ms(0), 0.01, 0.0002);
  EXPECT_NEAR(durations.quantile_ms(0.5), 5.0, 0.1);
  EXPECT_NEAR(durations.quantile_ms(0.99), 9.9, 0.2);
  EXPECT_NEAR(durations.quantile_ms(1), 10.0, 0.2);
}

TEST(DurationHistogram, TakesAnyDuration) {
  DurationHistogram durations;
  durations.add(-5);
  durations.add(0);
  durations.add(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(durations.count(), 3U);
  EXPECT_EQ(durations.quantile_ms(0), 0);
  EXPECT_GT(durations.quantile_ms(1), 3.4e7) << "nearly ten hours";
}

TEST(DurationHistogram, StartsAnewWhenCleared) {
  DurationHistogram durations;
  EXPECT_EQ(durations.quantile_ms(0.5), 0);
  durations.add(1000);
  durations.clear();
  EXPECT_EQ(durations.count(), 0U);
  EXPECT_EQ(durations.quantile_ms(0.99), 0);
}

}  // namespace
}  // namespace tandem
