#include "sdk/core/timeline/input_schedule.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

ScheduledDrive input(std::uint64_t number, Frame frame, std::int32_t gravity = 0) {
  return {number, frame, Drive{{gravity, 0, 0}, 0}};
}

TEST(InputSchedule, NumbersCountAsHeldOnlyWithoutAGap) {
  InputSchedule inputs;
  inputs.reset(4, {});
  EXPECT_EQ(inputs.held_to(), 4U);
  EXPECT_TRUE(*inputs.add(input(6, 20), 10));
  EXPECT_EQ(inputs.held_to(), 4U);
  EXPECT_TRUE(*inputs.add(input(5, 20), 10));
  EXPECT_EQ(inputs.held_to(), 6U);
}

TEST(InputSchedule, WhatIsHeldAlreadyIsIgnored) {
  InputSchedule inputs;
  inputs.reset(4, {});
  EXPECT_FALSE(*inputs.add(input(4, 20), 10));
  EXPECT_FALSE(*inputs.add(input(2, 3), 10));
  EXPECT_TRUE(*inputs.add(input(6, 20), 10));
  EXPECT_FALSE(*inputs.add(input(6, 21), 10));
  EXPECT_EQ(inputs.pending().size(), 1U);
}

TEST(InputSchedule, OfSeveralInputsForAFrameTheLastIssuedWins) {
  InputSchedule inputs;
  for (const std::uint64_t number : {2U, 3U, 1U}) {
    ASSERT_TRUE(inputs.add(input(number, 20, static_cast<std::int32_t>(number)), 10));
  }
  EXPECT_EQ(inputs.drive_for(20, {}).gravity[0], 3);
  EXPECT_EQ(inputs.drive_for(21, Drive{{7, 0, 0}, 0}).gravity[0], 7);
}

TEST(InputSchedule, AFrameThatIsOverIsRefused) {
  InputSchedule inputs;
  EXPECT_EQ(inputs.add(input(1, 10), 10).error().code, ErrorCode::kOutOfOrder);
}

TEST(InputSchedule, NumberZeroAndWildGravityAreRefused) {
  InputSchedule inputs;
  EXPECT_EQ(inputs.add(input(0, 20), 10).error().code, ErrorCode::kMalformed);
  EXPECT_EQ(inputs.add(input(1, 20, kVelocityLimit + 1), 10).error().code, ErrorCode::kMalformed);
}

TEST(InputSchedule, MoreThanTheLimitPendingIsRefusedUntilSomeHaveActed) {
  InputSchedule inputs;
  for (std::uint64_t n = 1; n <= kMaxPendingInputs; ++n) ASSERT_TRUE(inputs.add(input(n, 10 + n), 10));
  EXPECT_EQ(inputs.add(input(kMaxPendingInputs + 1, 900), 10).error().code, ErrorCode::kCapacity);
  inputs.forget(11);
  EXPECT_TRUE(inputs.add(input(kMaxPendingInputs + 1, 900), 11));
}

TEST(InputSchedule, AnInputBeyondAGapIsKeptAfterItActedSoThatTheGapCanClose) {
  InputSchedule inputs;
  ASSERT_TRUE(inputs.add(input(2, 11), 10));
  inputs.forget(12);
  ASSERT_TRUE(inputs.add(input(1, 14), 12));
  EXPECT_EQ(inputs.held_to(), 2U);
}

}  // namespace
}  // namespace tandem
