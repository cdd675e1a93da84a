#include <gtest/gtest.h>

#include "sdk/client/drawing/server_clock.hpp"

namespace tandem::client::of_clock {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kOffset = 1'700'000'000'000'000'000;

TEST(ServerClock, FindsTheOffsetBetweenDeltasAndEchoes) {
  ServerClock clock;
  for (std::int64_t t = kMs; t < 3000 * kMs; t += 30 * kMs) {
    clock.on_message(t + kOffset, t + 20 * kMs);             // 20 ms one way
    clock.on_echo(t + kOffset + 20 * kMs, t, t + 45 * kMs);  // 20 ms there, 25 ms back
  }
  EXPECT_NEAR(static_cast<double>(clock.offset_ns() - kOffset), 0, 1.0 * kMs);
  EXPECT_NEAR(static_cast<double>(clock.round_trip_ns()), 40.0 * kMs, 1.0 * kMs);
}

TEST(ServerClock, WithoutEchoesTakesTheFastestDelivery) {
  ServerClock clock;
  std::int64_t delay = 0;
  for (std::int64_t t = kMs; t < 1000 * kMs; t += 30 * kMs) {
    delay = (delay + 7) % 19;
    clock.on_message(t + kOffset, t + (5 + delay) * kMs);
  }
  EXPECT_EQ(clock.offset_ns(), kOffset - 5 * kMs);
}

TEST(ServerClock, FollowsDrift) {
  ServerClock clock;
  // 200 parts per million, for a minute: 12 ms.
  for (std::int64_t t = kMs; t < 60'000 * kMs; t += 30 * kMs) {
    const std::int64_t server = t + kOffset + t / 5000;
    clock.on_message(server, t + 2 * kMs);
    clock.on_echo(server + 2 * kMs, t, t + 4 * kMs);
  }
  EXPECT_NEAR(static_cast<double>(clock.offset_ns() - kOffset), 12.0 * kMs, 1.0 * kMs);
}

TEST(ServerClock, StartsAgainWhenSomebodySetsTheClock) {
  ServerClock clock;
  std::int64_t offset = kOffset;
  for (std::int64_t t = kMs; t < 2000 * kMs; t += 30 * kMs) {
    if (t > 1000 * kMs) offset = kOffset + 3'600'000 * kMs;
    clock.on_message(t + offset, t + 2 * kMs);
    clock.on_echo(t + offset + 2 * kMs, t, t + 4 * kMs);
  }
  EXPECT_NEAR(static_cast<double>(clock.offset_ns() - offset), 0, 1.0 * kMs);
}

TEST(ServerClock, EchoesOfNothingDoNotMakeItForget) {
  ServerClock clock;
  clock.on_message(kOffset + kMs, kMs);
  for (std::int64_t t = kMs; t < 20'000 * kMs; t += 1000 * kMs) clock.on_echo(kOffset + t, 0, t);
  EXPECT_TRUE(clock.known());
  EXPECT_EQ(clock.offset_ns(), kOffset);
}

TEST(Pacer, FollowsAServerThatJitters) {
  Pacer pacer(30);
  std::uint64_t random = 42;
  const double period = 1e9 / 30;
  for (Frame f = 1; f <= 300; ++f) {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    const auto jitter = static_cast<std::int64_t>(random >> 40U) % (3 * kMs);
    const auto published = static_cast<std::int64_t>(static_cast<double>(f) * period) + jitter;
    pacer.on_delta(f, kOffset + published, published + 4 * kMs);
    pacer.on_echo(kOffset + published, published - 4 * kMs, published + 4 * kMs);
  }
  const auto at = static_cast<std::int64_t>(300 * period) + 3 * kMs / 2;
  EXPECT_NEAR(pacer.server_frame(at), 300, 0.05);
  EXPECT_NEAR(static_cast<double>(pacer.due_ns(301) - at), period, 0.05 * period);
  EXPECT_GT(pacer.jitter_ms(), 0.2);
  EXPECT_LT(pacer.jitter_ms(), 3);
}

// Messages of six frames: the last of each is told when it is made.
TEST(Pacer, WithADelayAllFramesArePublishedSoLongAfterTheyWereMade) {
  Pacer pacer(30);
  pacer.set_delay(200 * kMs);
  const std::int64_t period = 33'333'333;
  for (Frame f = 6; f <= 60; f += 6) {
    const std::int64_t made = static_cast<std::int64_t>(f) * period;
    pacer.on_delta(f, kOffset + made, made + 4 * kMs);
    pacer.on_echo(kOffset + made, made - 4 * kMs, made + 4 * kMs);
  }
  EXPECT_NEAR(static_cast<double>(pacer.due_ns(60)), 60.0 * period + 200 * kMs, kMs);
  EXPECT_NEAR(static_cast<double>(pacer.arrival_ns(55)), 55.0 * period + 204 * kMs, kMs);
  EXPECT_NEAR(pacer.server_frame(60 * period + 200 * kMs), 60, 0.05);
  EXPECT_NEAR(pacer.arrived_frame(60 * period + 204 * kMs), 60, 0.05);
}

TEST(Pacer, ASuspensionShiftsAllFramesThatFollow) {
  Pacer pacer(30);
  const std::int64_t period = 33'333'333;
  for (Frame f = 1; f <= 100; ++f) {
    const std::int64_t published = static_cast<std::int64_t>(f) * period + (f > 50 ? 2000 * kMs : 0);
    pacer.on_delta(f, kOffset + published, published);
  }
  EXPECT_NEAR(pacer.server_frame(100 * period + 2000 * kMs), 100, 0.01);
}

}  // namespace
}  // namespace tandem::client::of_clock
