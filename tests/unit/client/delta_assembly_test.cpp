#include "sdk/client/following/delta_assembly.hpp"

#include <gtest/gtest.h>

#include <span>
#include <vector>

#include "sdk/wire/frame_bundle.hpp"

namespace tandem::client {
namespace {

using Outcome = DeltaAssembly::Outcome;

transport::DeltaMessage sample(Frame frame, std::uint32_t part = 0, std::uint32_t parts = 1,
                               std::size_t size = 4) {
  transport::DeltaMessage m;
  m.frame = frame;
  m.part = part;
  m.parts = parts;
  m.hash = frame * 10;
  m.payload.assign(size, static_cast<std::byte>(part));
  return m;
}

TEST(DeltaAssembly, PutsPartsTogetherInOrder) {
  DeltaAssembly assembly({.delta_bytes = 100});
  EXPECT_EQ(assembly.add(sample(7, 0, 3)), Outcome::kStored);
  EXPECT_EQ(assembly.add(sample(7, 1, 3)), Outcome::kStored);
  EXPECT_EQ(assembly.front(), nullptr);
  EXPECT_EQ(assembly.add(sample(7, 2, 3, 1)), Outcome::kStored);
  ASSERT_NE(assembly.front(), nullptr);
  EXPECT_EQ(assembly.front()->frame, 7U);
  EXPECT_EQ(assembly.front()->payload.size(), 9U);
  EXPECT_EQ(assembly.front()->payload.back(), std::byte{2});
}

TEST(DeltaAssembly, ANewFrameWhileOneIsIncompleteMeansALostPart) {
  DeltaAssembly assembly({.delta_bytes = 100});
  static_cast<void>(assembly.add(sample(7, 0, 2)));
  EXPECT_EQ(assembly.add(sample(8)), Outcome::kLostPart);
  ASSERT_NE(assembly.front(), nullptr);
  EXPECT_EQ(assembly.front()->frame, 8U);
}

TEST(DeltaAssembly, ASkippedPartMeansALostPart) {
  DeltaAssembly assembly({.delta_bytes = 100});
  static_cast<void>(assembly.add(sample(7, 0, 3)));
  EXPECT_EQ(assembly.add(sample(7, 2, 3)), Outcome::kLostPart);
  EXPECT_EQ(assembly.front(), nullptr);
  EXPECT_EQ(assembly.add(sample(8)), Outcome::kStored);
}

TEST(DeltaAssembly, ALostFirstPartIsNoticed) {
  DeltaAssembly assembly({.delta_bytes = 100});
  static_cast<void>(assembly.add(sample(7)));
  EXPECT_EQ(assembly.add(sample(8, 1, 2)), Outcome::kLostPart);
  EXPECT_EQ(assembly.front(), nullptr);
}

transport::DeltaMessage quiet_sample(Frame frame, std::uint32_t quiet) {
  transport::DeltaMessage m = sample(frame, 0, 1, 0);
  m.earlier = quiet;
  m.last_input = 3;
  return m;
}

// The frames that are held, oldest first. Checks that all that `last` tells are alike.
std::vector<Frame> take_all(DeltaAssembly& assembly, Frame last) {
  std::vector<Frame> frames;
  for (; assembly.front() != nullptr; assembly.pop()) {
    const CompleteDelta& delta = *assembly.front();
    frames.push_back(delta.frame);
    if (delta.frame + 10 < last) continue;
    EXPECT_EQ(delta.hash, last * 10);
    EXPECT_EQ(delta.last_input, 3U);
    EXPECT_TRUE(delta.payload.empty());
  }
  return frames;
}

TEST(DeltaAssembly, QuietFramesAreFramesOfTheirOwn) {
  DeltaAssembly assembly({.earlier = 10, .delta_bytes = 100});
  EXPECT_EQ(assembly.add(quiet_sample(20, 3)), Outcome::kStored) << "the first that comes";
  EXPECT_EQ(take_all(assembly, 20), (std::vector<Frame>{17, 18, 19, 20}));
  EXPECT_EQ(assembly.add(quiet_sample(23, 2)), Outcome::kStored);
  EXPECT_EQ(take_all(assembly, 23), (std::vector<Frame>{21, 22, 23}));
  EXPECT_EQ(assembly.add(quiet_sample(23, 2)), Outcome::kIgnored) << "once more";
  EXPECT_EQ(assembly.add(quiet_sample(26, 5)), Outcome::kStored) << "some of them came before";
  EXPECT_EQ(take_all(assembly, 26), (std::vector<Frame>{24, 25, 26}));
  EXPECT_EQ(assembly.add(quiet_sample(30, 2)), Outcome::kGap) << "27 is missing";
  EXPECT_EQ(take_all(assembly, 30), (std::vector<Frame>{28, 29, 30}));
}

TEST(DeltaAssembly, ASnapshotInTheMidstOfQuietFramesFits) {
  DeltaAssembly assembly({.earlier = 10, .delta_bytes = 100});
  EXPECT_EQ(assembly.add(quiet_sample(20, 9)), Outcome::kStored);
  ASSERT_NE(assembly.front(), nullptr);
  EXPECT_EQ(assembly.front()->frame, 11U);
  assembly.drop_through(15);
  EXPECT_EQ(take_all(assembly, 20), (std::vector<Frame>{16, 17, 18, 19, 20}));
}

TEST(DeltaAssembly, QuietFramesHaveRules) {
  DeltaAssembly assembly({.earlier = 10, .delta_bytes = 100, .frames = 12});
  EXPECT_EQ(assembly.add(quiet_sample(20, 11)), Outcome::kRefused) << "too much work at once";
  EXPECT_EQ(assembly.add(quiet_sample(5, 5)), Outcome::kRefused) << "frames begin at 1";
  auto broken = quiet_sample(20, 2);
  broken.payload.resize(1);
  EXPECT_EQ(assembly.add(std::move(broken)), Outcome::kRefused) << "not the bytes of three frames";
  auto in_parts = quiet_sample(20, 2);
  in_parts.parts = 2;
  EXPECT_EQ(assembly.add(std::move(in_parts)), Outcome::kRefused);
  EXPECT_EQ(assembly.add(quiet_sample(20, 10)), Outcome::kStored);
  EXPECT_EQ(assembly.add(quiet_sample(22, 1)), Outcome::kOverflow);
}

TEST(DeltaAssembly, FramesThatShareAMessageAreFramesOfTheirOwn) {
  DeltaAssembly assembly({.earlier = 10, .period_ns = 5, .delta_bytes = 100});
  transport::FrameBundle bundle;
  const std::vector<std::byte> payload(3, std::byte{7});
  for (Frame frame = 11; frame <= 14; ++frame)
    bundle.add(frame, 10 * frame, frame == 12 ? std::span<const std::byte>() : payload);
  auto message = bundle.take();
  message.last_input = 3;
  message.server_time_ns = 1000;
  EXPECT_EQ(assembly.add(sample(11)), Outcome::kStored);
  assembly.pop();
  EXPECT_EQ(assembly.add(std::move(message)), Outcome::kStored) << "the first of them came before";
  for (Frame frame = 12; frame <= 14; ++frame, assembly.pop()) {
    ASSERT_NE(assembly.front(), nullptr);
    EXPECT_EQ(assembly.front()->frame, frame);
    EXPECT_EQ(assembly.front()->hash, 10 * frame);
    EXPECT_EQ(assembly.front()->payload.size(), frame == 12 ? 0U : 3U);
    EXPECT_EQ(assembly.front()->last_input, 3U);
    EXPECT_EQ(assembly.front()->more, 14 - frame);
    EXPECT_EQ(assembly.front()->server_time_ns, 1000 - 5 * static_cast<std::int64_t>(14 - frame));
  }
  EXPECT_EQ(assembly.front(), nullptr);
}

TEST(DeltaAssembly, ASkippedFrameIsAGapAndTheRunStartsBehindIt) {
  DeltaAssembly assembly({.delta_bytes = 100});
  static_cast<void>(assembly.add(sample(7)));
  EXPECT_EQ(assembly.add(sample(9)), Outcome::kGap);
  EXPECT_EQ(assembly.size(), 1U);
  EXPECT_EQ(assembly.front()->frame, 9U);
  EXPECT_EQ(assembly.add(sample(10)), Outcome::kStored);
}

TEST(DeltaAssembly, AFrameHeldAlreadyIsIgnored) {
  DeltaAssembly assembly({.delta_bytes = 100});
  static_cast<void>(assembly.add(sample(7)));
  EXPECT_EQ(assembly.add(sample(7)), Outcome::kIgnored);
  EXPECT_EQ(assembly.add(sample(6)), Outcome::kIgnored);
  EXPECT_EQ(assembly.size(), 1U);
}

// A gateway sends a viewer that joins again nothing between the gap and the snapshot.
TEST(DeltaAssembly, FramesThatASnapshotHoldsAreNoGap) {
  DeltaAssembly assembly({.delta_bytes = 100});
  EXPECT_EQ(assembly.add(sample(5, 0, 1)), Outcome::kStored);
  assembly.drop_through(20);
  EXPECT_EQ(assembly.front(), nullptr);
  EXPECT_EQ(assembly.add(sample(20, 0, 1)), Outcome::kIgnored);
  EXPECT_EQ(assembly.add(sample(21, 0, 1)), Outcome::kStored);
  EXPECT_EQ(assembly.add(sample(22, 0, 2)), Outcome::kStored);
  assembly.drop_through(30);
  EXPECT_EQ(assembly.add(sample(22, 1, 2)), Outcome::kIgnored)
      << "the rest of a frame that the snapshot holds";
  EXPECT_EQ(assembly.add(sample(31, 0, 1)), Outcome::kStored);
  EXPECT_EQ(assembly.add(sample(33, 0, 1)), Outcome::kGap);
}

TEST(DeltaAssembly, SubscribingInTheMiddleOfAFrameIsNoLoss) {
  DeltaAssembly assembly({.delta_bytes = 100});
  EXPECT_EQ(assembly.add(sample(7, 1, 2)), Outcome::kIgnored);
  EXPECT_EQ(assembly.add(sample(8)), Outcome::kStored);
}

TEST(DeltaAssembly, RefusesWhatBreaksTheFormat) {
  for (auto bad : {sample(7, 0, 0), sample(7, 2, 2), sample(0), sample(7, 0, 1, 101), sample(7, 0, 2, 0)}) {
    DeltaAssembly assembly({.delta_bytes = 100});
    EXPECT_EQ(assembly.add(std::move(bad)), Outcome::kRefused);
    EXPECT_EQ(assembly.front(), nullptr);
  }
}

TEST(DeltaAssembly, RefusesPartsThatDisagreeOrGrowBeyondTheDeclaredSize) {
  DeltaAssembly assembly({.delta_bytes = 100});
  static_cast<void>(assembly.add(sample(7, 0, 2)));
  auto other = sample(7, 1, 2);
  other.hash += 1;
  EXPECT_EQ(assembly.add(std::move(other)), Outcome::kRefused);
  static_cast<void>(assembly.add(sample(7, 0, 2, 60)));
  EXPECT_EQ(assembly.add(sample(7, 1, 2, 60)), Outcome::kRefused);
}

TEST(DeltaAssembly, OverflowDropsAllAndCountsTheHighWaterMark) {
  DeltaAssembly assembly({.delta_bytes = 100, .frames = 3});
  for (Frame f = 1; f <= 3; ++f) EXPECT_EQ(assembly.add(sample(f)), Outcome::kStored);
  EXPECT_EQ(assembly.add(sample(4)), Outcome::kOverflow);
  EXPECT_EQ(assembly.size(), 0U);
  EXPECT_EQ(assembly.high_water(), 3U);
  EXPECT_EQ(assembly.add(sample(9)), Outcome::kStored);
}

TEST(DeltaAssembly, HeldBytesAreBounded) {
  DeltaAssembly assembly({.delta_bytes = 100, .frames = 1000, .total_bytes = 500});
  Frame f = 1;
  while (assembly.add(sample(f, 0, 1, 100)) == Outcome::kStored) ++f;
  EXPECT_EQ(f, 6U);
}

}  // namespace
}  // namespace tandem::client
