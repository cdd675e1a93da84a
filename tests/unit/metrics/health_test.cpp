#include "services/program/metrics/health.hpp"

#include <gtest/gtest.h>

#include "services/program/metrics/rate_watch.hpp"

namespace tandem::metrics {
namespace {

TEST(MetricsHealth, AProgramThatStartsIsAliveAndNotReady) {
  const Health health;
  EXPECT_TRUE(health.alive(kSecond).good);
  EXPECT_FALSE(health.ready(kSecond).good);
  EXPECT_EQ(health.ready(kSecond).text, "it starts\n");
}

TEST(MetricsHealth, AnObstacleIsNotReadyButAlive) {
  Health health;
  health.beat(kSecond, "it waits");
  EXPECT_TRUE(health.alive(kSecond).good);
  EXPECT_FALSE(health.ready(kSecond).good);
  EXPECT_EQ(health.ready(kSecond).text, "it waits\n");
  health.beat(kSecond, nullptr);
  EXPECT_TRUE(health.ready(kSecond).good);
}

TEST(MetricsHealth, WorkThatStopsIsNeither) {
  Health health;
  health.beat(kSecond, nullptr);
  EXPECT_TRUE(health.ready(kSecond + Health::kHangsNs).good);
  const std::int64_t later_ns = kSecond + Health::kHangsNs + 1;
  EXPECT_FALSE(health.alive(later_ns).good);
  EXPECT_FALSE(health.ready(later_ns).good);
  EXPECT_EQ(health.alive(later_ns).text, "its work has not gone on for 5 s\n");
}

TEST(MetricsHealth, FramesThatStandStillThoughTheyAreMadeAreNotAlive) {
  Health health;
  std::int64_t now_ns = kSecond;
  const auto stand = [&](bool due, std::int64_t for_ns) {
    for (const std::int64_t until_ns = now_ns + for_ns; now_ns <= until_ns; now_ns += kSecond / 4) {
      health.saw_frames(7, due, now_ns);
      health.beat(now_ns, nullptr);
    }
  };
  stand(false, 10 * Health::kStandsNs);
  EXPECT_TRUE(health.alive(now_ns).good) << "none are due";
  stand(true, Health::kStandsNs);
  EXPECT_TRUE(health.alive(now_ns - kSecond / 4).good);
  stand(true, kSecond);
  EXPECT_FALSE(health.alive(now_ns).good);
  EXPECT_FALSE(health.ready(now_ns).good);
  EXPECT_EQ(health.alive(now_ns).text, "no frame has come for 11 s, although their source makes them\n");
  health.saw_frames(8, true, now_ns);
  EXPECT_TRUE(health.alive(now_ns).good);
}

TEST(MetricsRateWatch, SeesTheLastThreeSeconds) {
  RateWatch watch;
  EXPECT_EQ(watch.per_second(), 0);
  for (int quarter = 0; quarter <= 40; ++quarter)
    watch.saw(static_cast<std::uint64_t>(quarter) * 10, quarter * kSecond / 4);
  EXPECT_DOUBLE_EQ(watch.per_second(), 40);
  for (int quarter = 41; quarter <= 46; ++quarter) watch.saw(400, quarter * kSecond / 4);
  EXPECT_DOUBLE_EQ(watch.per_second(), 20);
  for (int quarter = 47; quarter <= 52; ++quarter) watch.saw(400, quarter * kSecond / 4);
  EXPECT_DOUBLE_EQ(watch.per_second(), 0);
}

}  // namespace
}  // namespace tandem::metrics
