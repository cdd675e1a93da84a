#include "services/gateway/viewing/snapshot_parts.hpp"

#include "fake_world.hpp"

namespace tandem::gateway {
namespace {

std::shared_ptr<const SnapshotParts> snapshot_of(std::size_t bytes, std::vector<OutgoingPtr> inputs = {}) {
  return std::make_shared<SnapshotParts>(
      following::FollowedWorld::Cut{
          .stream = {}, .frame = 9, .last_input = 0, .bytes = transport::Bytes(bytes)},
      kEpoch, std::move(inputs));
}

transport::AckMessage holds(std::uint32_t parts, std::uint32_t of) {
  transport::AckMessage ack;
  ack.snapshot_frame = 9;
  ack.snapshot_parts = of;
  if (parts < of) ack.missing = {parts, of - parts};
  return ack;
}

TEST(SnapshotParts, AreCutsOfTheWhole) {
  const auto snapshot = snapshot_of(5000);
  ASSERT_EQ(snapshot->parts.size(), 4U);
  const auto last = transport::read_gateway_envelope(snapshot->parts[3]->envelope());
  ASSERT_TRUE(last);
  const auto& part = std::get<transport::SnapshotMessage>(*last);
  EXPECT_EQ(part.part, 3U);
  EXPECT_EQ(part.parts, 4U);
  EXPECT_EQ(part.frame, 9U);
  EXPECT_EQ(part.total_bytes, 5000U);
  EXPECT_EQ(part.bytes.size(), 5000U - 3 * 1300);
}

TEST(SnapshotParts, AreNoMoreThanTheMost) {
  EXPECT_LE(snapshot_of(10'000'000)->parts.size(), SnapshotParts::kMaxParts);
}

/// Takes all that may go now.
std::uint32_t drain(SnapshotPassage& passage, std::int64_t now_ns) {
  std::uint32_t taken = 0;
  for (; passage.has_next(now_ns); ++taken) EXPECT_TRUE(passage.next(now_ns));
  return taken;
}

TEST(SnapshotPassage, NoMoreIsOnItsWayThanTheWindow) {
  SnapshotPassage passage(snapshot_of(130'000), kStart);
  EXPECT_EQ(drain(passage, kStart), 6U) << "7,800 bytes";
  passage.acknowledged(holds(6, 100), kStart + 100 * kMillisecond);
  EXPECT_GE(drain(passage, kStart + 100 * kMillisecond), 12U) << "a round trip doubles it";
  EXPECT_TRUE(passage.unfinished());
}

TEST(SnapshotPassage, WhereALinkIsFullItDoesNotGrow) {
  SnapshotPassage passage(snapshot_of(1'300'000), kStart);
  // A link of 1,300 bytes in 20 ms, whatever is sent at once.
  std::int64_t now_ns = kStart, free_ns = kStart;
  std::uint32_t sent = 0, held = 0;
  std::vector<std::int64_t> arrives_ns;
  std::size_t most = 0;
  for (; now_ns < kStart + 8 * kSecond; now_ns += kMillisecond) {
    while (passage.has_next(now_ns)) {
      EXPECT_TRUE(passage.next(now_ns));
      free_ns = std::max(free_ns, now_ns) + 20 * kMillisecond;
      arrives_ns.push_back(free_ns);
      ++sent;
    }
    while (held < sent && arrives_ns[held] <= now_ns) passage.acknowledged(holds(++held, 1000), now_ns);
    if (now_ns > kStart + 4 * kSecond) most = std::max<std::size_t>(most, sent - held);
  }
  EXPECT_GT(held, 350U) << "nearly all of the link";
  EXPECT_LT(most, 20U) << "0.4 s of it at most";
}

TEST(SnapshotPassage, InputsGoFirst) {
  const auto input = make_outgoing(transport::ScheduledInputMessage{});
  SnapshotPassage passage(snapshot_of(100, {input}), kStart);
  ASSERT_TRUE(passage.has_next(kStart));
  EXPECT_EQ(passage.next(kStart), input);
  ASSERT_TRUE(passage.has_next(kStart));
  EXPECT_TRUE(passage.next(kStart));
  EXPECT_FALSE(passage.unfinished());
}

TEST(SnapshotPassage, AcknowledgementsThatMakeNoSenseChangeNothing) {
  SnapshotPassage passage(snapshot_of(13'000), kStart);
  drain(passage, kStart);
  for (const auto& ack : {holds(10, 11), holds(0, 10), transport::AckMessage()}) {
    passage.acknowledged(ack, kStart + kSecond);
    EXPECT_FALSE(passage.has_next(kStart + kSecond));
  }
  passage.acknowledged(holds(10, 10), kStart + kSecond);  // more than was sent
  EXPECT_TRUE(passage.has_next(kStart + kSecond));
}

}  // namespace
}  // namespace tandem::gateway
