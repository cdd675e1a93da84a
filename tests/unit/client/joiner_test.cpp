#include "sdk/client/following/joiner.hpp"

#include <gtest/gtest.h>

namespace tandem::client::of_joiner {
namespace {

constexpr std::int64_t kMs = 1'000'000;

transport::SnapshotMessage snapshot(Frame frame) {
  transport::SnapshotMessage m;
  m.frame = frame;
  return m;
}

TEST(Joiner, AsksAtOnceAndAgainWithGrowingPatience) {
  Joiner joiner;
  joiner.start(0);
  EXPECT_TRUE(joiner.poll(0));
  EXPECT_EQ(joiner.attempt(), 1U);
  EXPECT_FALSE(joiner.poll(999 * kMs));
  EXPECT_TRUE(joiner.poll(1000 * kMs));
  EXPECT_FALSE(joiner.poll(2999 * kMs));
  EXPECT_TRUE(joiner.poll(3000 * kMs));
  EXPECT_EQ(joiner.attempt(), 3U);
}

TEST(Joiner, TakesASnapshotNotOlderThanTheFirstBufferedDeltaMinusOne) {
  Joiner joiner;
  joiner.start(0);
  static_cast<void>(joiner.poll(0));
  joiner.offer(snapshot(9));
  const auto chosen = joiner.choose(10, kMs);
  ASSERT_TRUE(chosen.has_value());
  EXPECT_EQ(chosen->frame, 9U);
}

TEST(Joiner, DropsASnapshotThatLeavesAGapAndAsksAgainSoon) {
  Joiner joiner;
  joiner.start(0);
  static_cast<void>(joiner.poll(0));
  joiner.offer(snapshot(8));
  EXPECT_FALSE(joiner.choose(10, kMs).has_value());
  EXPECT_FALSE(joiner.choose(std::nullopt, 999 * kMs).has_value());
  EXPECT_TRUE(joiner.poll(Joiner::kPatienceNs / 4));
}

TEST(Joiner, WithNothingBufferedWaitsForSnapshotsNewerThanItsQuestion) {
  Joiner joiner;
  joiner.start(0);
  static_cast<void>(joiner.poll(0));
  joiner.offer(snapshot(3));  // kept by the topic from an earlier joiner
  EXPECT_FALSE(joiner.choose(std::nullopt, Joiner::kQuietNs - 1).has_value());
  joiner.offer(snapshot(5));
  const auto chosen = joiner.choose(std::nullopt, Joiner::kQuietNs);
  ASSERT_TRUE(chosen.has_value());
  EXPECT_EQ(chosen->frame, 5U);
}

TEST(Joiner, KeepsTheNewestSnapshot) {
  Joiner joiner;
  joiner.start(0);
  static_cast<void>(joiner.poll(0));
  joiner.offer(snapshot(12));
  joiner.offer(snapshot(9));
  EXPECT_EQ(joiner.choose(9, kMs)->frame, 12U);
}

TEST(Joiner, IgnoresSnapshotsBeforeItAsked) {
  Joiner joiner;
  joiner.start(0);
  joiner.offer(snapshot(12));
  static_cast<void>(joiner.poll(0));
  EXPECT_FALSE(joiner.choose(1, kMs).has_value());
}

TEST(Joiner, AClientThatFailsAtOnceDoesNotAskOnEveryFrame) {
  Joiner joiner;
  joiner.start(0);
  static_cast<void>(joiner.poll(0));
  joiner.start(kMs);
  EXPECT_FALSE(joiner.poll(Joiner::kMinSpacingNs - 1));
  EXPECT_TRUE(joiner.poll(Joiner::kMinSpacingNs));
}

TEST(Joiner, DoesNotAskAgainWhileASnapshotComesIn) {
  Joiner joiner;
  joiner.start(0);
  static_cast<void>(joiner.poll(0));
  for (int part = 1; part <= 10; ++part) {
    joiner.progress(part * 900 * kMs);
    EXPECT_FALSE(joiner.poll((part + 1) * 900 * kMs));
  }
  EXPECT_TRUE(joiner.poll(10'000 * kMs));
}

TEST(Joiner, ARefusedSnapshotBringsAnotherQuestion) {
  Joiner joiner;
  joiner.start(0);
  static_cast<void>(joiner.poll(0));
  joiner.ask_again(10 * kMs);
  EXPECT_FALSE(joiner.poll(200 * kMs));
  EXPECT_TRUE(joiner.poll(250 * kMs));
  EXPECT_EQ(joiner.attempt(), 2U);
}

}  // namespace
}  // namespace tandem::client::of_joiner
