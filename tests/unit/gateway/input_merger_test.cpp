#include "services/follow/following/input_merger.hpp"

#include "fake_world.hpp"

namespace tandem::gateway {
namespace {

using transport::Reason;

class InputMergerTest : public ::testing::Test {
 protected:
  using Kind = client::InputOutcome::Kind;

  void gravity(ViewerId viewer, std::uint64_t number, double x) {
    transport::InputMessage input;
    input.kind = static_cast<std::uint32_t>(transport::InputKind::kGravity);
    input.number = number;
    input.values = {x, 0, 0};
    merger.add(viewer, std::move(input), world, now_ns, verdicts);
  }
  void push(ViewerId viewer, std::uint64_t number) {
    transport::InputMessage input;
    input.kind = static_cast<std::uint32_t>(transport::InputKind::kPush);
    input.number = number;
    input.values.assign(7, 0);  // well_formed()
    merger.add(viewer, std::move(input), world, now_ns, verdicts);
  }
  void outcome(Kind kind, std::uint64_t number, Frame frame, Reason reason) {
    merger.on_outcome({kind, number, frame, static_cast<std::uint32_t>(reason), 0}, verdicts);
  }

  FakeWorld world;
  following::InputMerger merger;
  std::vector<following::InputMerger::Verdict> verdicts;
  std::int64_t now_ns = kStart;
};

TEST_F(InputMergerTest, OfGravitiesTheLastOneWins) {
  gravity(1, 1, 1);  // goes at once
  gravity(1, 2, 2);
  gravity(2, 1, 3);
  ASSERT_EQ(world.sent.size(), 1U);
  EXPECT_TRUE(merger.waiting());
  now_ns += kSecond / 20;
  merger.flush(world, now_ns, verdicts);
  ASSERT_EQ(world.sent.size(), 2U);
  EXPECT_EQ(world.sent[1].values[0], 3);
  EXPECT_FALSE(merger.waiting());
}

TEST_F(InputMergerTest, ThoseBeforeItShareItsFate) {
  gravity(1, 1, 1);
  gravity(1, 2, 2);
  gravity(2, 1, 3);
  now_ns += kSecond / 20;
  merger.flush(world, now_ns, verdicts);
  EXPECT_TRUE(verdicts.empty());
  outcome(Kind::kActed, 2, 50, Reason::kNone);
  ASSERT_EQ(verdicts.size(), 2U);
  EXPECT_EQ(verdicts[0].claim.sender, 1U);
  EXPECT_EQ(verdicts[0].claim.number, 2U);
  EXPECT_EQ(verdicts[1].claim.sender, 2U);
  EXPECT_EQ(verdicts[1].acts_on, 50U);
  verdicts.clear();
  outcome(Kind::kRefused, 1, 0, Reason::kInvalid);
  ASSERT_EQ(verdicts.size(), 1U);
  EXPECT_EQ(verdicts[0].reason, Reason::kInvalid);
}

TEST_F(InputMergerTest, GravitiesHaveARate) {
  int sent_before = 0;
  for (int ms = 0; ms < 2000; ++ms) {
    now_ns += kMillisecond;
    gravity(1, static_cast<std::uint64_t>(ms), ms);
    if (ms == 999) sent_before = static_cast<int>(world.sent.size());
  }
  EXPECT_NEAR(static_cast<int>(world.sent.size()) - sent_before, following::InputMerger::kGravitiesPerSecond,
              1);
}

TEST_F(InputMergerTest, EverythingElseSharesARate) {
  for (std::uint64_t i = 0; i < 50; ++i) push(i, 1);
  EXPECT_EQ(world.sent.size(), 30U);
  ASSERT_EQ(verdicts.size(), 20U);
  EXPECT_EQ(verdicts[0].reason, Reason::kRateLimited);
  EXPECT_EQ(verdicts[0].claim.sender, 30U);
}

TEST_F(InputMergerTest, WhatCannotBeSentIsRefusedAtOnce) {
  world.plays = false;
  push(1, 1);
  gravity(2, 1, 1);
  ASSERT_EQ(verdicts.size(), 2U);
  EXPECT_EQ(verdicts[0].reason, Reason::kNotPlaying);
}

TEST_F(InputMergerTest, WhatNobodyKnowsIsSaidToBeUnknown) {
  push(1, 1);
  outcome(Kind::kUnknown, 1, 0, Reason::kNone);
  ASSERT_EQ(verdicts.size(), 1U);
  EXPECT_EQ(verdicts[0].fate, following::InputMerger::Verdict::Fate::kUnknown);
}

TEST_F(InputMergerTest, OfAnEpochThatIsOverNobodyIsTold) {
  push(1, 1);
  gravity(1, 2, 1);
  gravity(1, 3, 1);
  merger.clear();
  outcome(Kind::kActed, 1, 5, Reason::kNone);
  now_ns += kSecond;
  merger.flush(world, now_ns, verdicts);
  EXPECT_TRUE(verdicts.empty());
  EXPECT_EQ(world.sent.size(), 2U);
}

}  // namespace
}  // namespace tandem::gateway
