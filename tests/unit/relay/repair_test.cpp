#include "sdk/transport/nats/repair.hpp"

#include <gtest/gtest.h>

#include "sdk/transport/nats/sent_log.hpp"

namespace tandem::transport::nats {
namespace {

DeltaMessage delta(Frame frame, std::uint64_t last_input = 0, std::uint32_t part = 0,
                   std::uint32_t parts = 1) {
  DeltaMessage message;
  message.frame = frame;
  message.last_input = last_input;
  message.part = part;
  message.parts = parts;
  message.payload.resize(10);
  return message;
}

std::vector<Frame> frames(DeltaRepair& repair, const InputRepair& inputs) {
  std::vector<DeltaMessage> out;
  repair.release(inputs, out);
  std::vector<Frame> frames;
  for (const DeltaMessage& message : out) frames.push_back(message.frame);
  return frames;
}

TEST(DeltaRepair, HandsOutInOrderWithoutAGap) {
  DeltaRepair repair;
  const InputRepair inputs;
  repair.take(delta(5));
  EXPECT_EQ(frames(repair, inputs), (std::vector<Frame>{5}));
  repair.take(delta(8));
  repair.take(delta(7));
  EXPECT_TRUE(frames(repair, inputs).empty());
  EXPECT_EQ(repair.missing(), 1U);
  EXPECT_TRUE(repair.overtaken());
  repair.take(delta(6));
  EXPECT_EQ(frames(repair, inputs), (std::vector<Frame>{6, 7, 8}));
  EXPECT_EQ(repair.missing(), 0U);
}

TEST(DeltaRepair, WaitsForThePartsOfAFrame) {
  DeltaRepair repair;
  const InputRepair inputs;
  repair.take(delta(5, 0, 0, 3));
  repair.take(delta(5, 0, 2, 3));
  repair.take(delta(6));
  EXPECT_TRUE(frames(repair, inputs).empty());
  EXPECT_EQ(repair.missing(), 1U);
  repair.take(delta(5, 0, 1, 3));
  EXPECT_EQ(frames(repair, inputs), (std::vector<Frame>{5, 5, 5, 6}));
}

TEST(DeltaRepair, ABeatTellsOfFramesThatNobodyOvertook) {
  DeltaRepair repair;
  const InputRepair inputs;
  repair.exists(9);
  EXPECT_EQ(repair.missing(), 0U) << "it has not begun";
  repair.take(delta(5));
  EXPECT_EQ(frames(repair, inputs).size(), 1U);
  repair.exists(9);
  EXPECT_EQ(repair.missing(), 4U);
  EXPECT_FALSE(repair.overtaken());
}

TEST(DeltaRepair, WhatCannotBeHadIsLeftOut) {
  DeltaRepair repair;
  const InputRepair inputs;
  repair.take(delta(5));
  frames(repair, inputs);
  repair.take(delta(9));
  repair.skip_to(9);
  EXPECT_EQ(frames(repair, inputs), (std::vector<Frame>{9}));
}

TEST(DeltaRepair, ADeltaWaitsForTheInputsThatItCounts) {
  DeltaRepair repair;
  InputRepair inputs;
  inputs.begin(3);
  repair.take(delta(5, 5));
  EXPECT_TRUE(frames(repair, inputs).empty());
  EXPECT_EQ(repair.wanted_input(), 5U);
  EXPECT_EQ(inputs.missing(5), 2U);
  EXPECT_TRUE(inputs.came(5));
  EXPECT_FALSE(inputs.came(5));
  EXPECT_EQ(inputs.missing(5), 1U);
  EXPECT_TRUE(inputs.came(4));
  EXPECT_EQ(frames(repair, inputs), (std::vector<Frame>{5}));
}

TEST(DeltaRepair, OfTwoThatDifferTheOneThatWasAskedForCounts) {
  DeltaRepair repair;
  const InputRepair inputs;
  repair.take(delta(5));
  frames(repair, inputs);
  DeltaMessage forged = delta(7);
  forged.hash = 1;
  const auto forge = [&] { repair.take(DeltaMessage(forged)); };
  forge();
  repair.take(delta(7));
  EXPECT_EQ(repair.missing(), 2U) << "neither is kept";
  forge();
  repair.take(delta(7), true);
  repair.take(delta(7));
  repair.take(delta(6));
  std::vector<DeltaMessage> out;
  repair.release(inputs, out);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_NE(out[1].hash, forged.hash);
}

TEST(DeltaRepair, AFrameBeyondAllThatIsHeldIsNotMissed) {
  DeltaRepair repair;
  repair.take(delta(5));
  repair.take(delta(5 + DeltaRepair::kMaxFrames));
  frames(repair, InputRepair());
  EXPECT_EQ(repair.missing(), 0U);
}

TEST(AskTimer, AsksAtOnceAndAgainWhenNothingComes) {
  AskTimer timer;
  std::int64_t now = kSecond;
  EXPECT_TRUE(timer.due(10, 100, true, now));
  EXPECT_FALSE(timer.due(10, 100, true, now + AskTimer::kLeastNs / 2));
  now += AskTimer::kLeastNs;
  EXPECT_TRUE(timer.due(10, 100, true, now));
  EXPECT_FALSE(timer.due(10, 100, true, now + AskTimer::kLeastNs)) << "it waits longer each time";
  EXPECT_FALSE(timer.due(50, 60, true, now + 2 * AskTimer::kLeastNs)) << "the answer goes on";
  EXPECT_TRUE(timer.due(110, 5, true, now + 2 * AskTimer::kLeastNs)) << "another run";
}

TEST(AskTimer, WhatOnlyABeatTellsOfMayBeOnItsWay) {
  AskTimer timer;
  EXPECT_FALSE(timer.due(10, 1, false, kSecond));
  EXPECT_TRUE(timer.due(10, 1, false, kSecond + AskTimer::kGraceNs));
}

TEST(SentLog, KeepsHalfAMinuteWithinItsBytes) {
  SentLog log(1000);
  EXPECT_LT(log.range().newest, log.range().oldest);
  const auto message = std::make_shared<const Bytes>(100);
  for (std::uint64_t number = 5; number < 10; ++number) log.add(number, message, kSecond);
  EXPECT_EQ(log.range(), (Beat::Range{5, 9}));
  log.add(9, message, kSecond);  // a second part
  std::vector<SentLog::Message> out;
  EXPECT_EQ(log.list(8, 10, 1000, out), 300U);
  EXPECT_EQ(out.size(), 3U);
  out.clear();
  EXPECT_EQ(log.list(1, 10, 250, out), 200U) << "as many as the limit allows";
  log.add(10, message, 31 * kSecond + kSecond + 1);
  EXPECT_EQ(log.range(), (Beat::Range{10, 10}));
  for (std::uint64_t number = 11; number < 40; ++number) log.add(number, message, 33 * kSecond);
  EXPECT_EQ(log.range(), (Beat::Range{30, 39}));
  log.add(50, message, 33 * kSecond);
  EXPECT_EQ(log.range(), (Beat::Range{50, 50})) << "a gap begins anew";
}

}  // namespace
}  // namespace tandem::transport::nats
