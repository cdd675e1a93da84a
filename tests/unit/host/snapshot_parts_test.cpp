#include "services/host/snapshot_parts.hpp"

#include <gtest/gtest.h>

#include "services/host/host.hpp"

namespace tandem::host {
namespace {

constexpr Epoch kEpoch = 5;
constexpr StreamId kStream{2, 3};

class SnapshotPartsTest : public ::testing::Test {
 protected:
  std::vector<transport::SnapshotMessage> send(std::int64_t now_ns) {
    parts.send(now_ns);
    std::vector<transport::SnapshotMessage> out;
    while (const auto message = outbox.pop(std::chrono::nanoseconds{0})) {
      out.push_back(std::get<transport::SnapshotMessage>(*message));
    }
    return out;
  }
  static transport::AckMessage lacks(Frame frame, std::uint32_t count, std::vector<std::uint32_t> missing) {
    transport::AckMessage ack;
    ack.stream = kStream;
    ack.snapshot_frame = frame;
    ack.snapshot_parts = count;
    ack.missing = std::move(missing);
    return ack;
  }
  static std::vector<std::byte> content(std::size_t size) {
    std::vector<std::byte> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i % 251);
    return bytes;
  }
  Outbox outbox{{}};
  SnapshotParts parts{outbox};
};

TEST_F(SnapshotPartsTest, AreConsecutiveCutsThatTellWhatTheyBelongTo) {
  const auto bytes = content(2 * kPartBytes + 1);
  parts.start(kEpoch, kStream, 7, bytes);
  const auto sent = send(0);
  ASSERT_EQ(sent.size(), 3U);
  std::vector<std::byte> joined;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(sent[i].epoch, kEpoch);
    EXPECT_EQ(sent[i].stream, kStream);
    EXPECT_EQ(sent[i].frame, 7U);
    EXPECT_EQ(sent[i].part, i);
    EXPECT_EQ(sent[i].parts, 3U);
    EXPECT_EQ(sent[i].total_bytes, bytes.size());
    joined.insert(joined.end(), sent[i].bytes.begin(), sent[i].bytes.end());
  }
  EXPECT_EQ(joined, bytes);
  EXPECT_EQ(parts.bytes(), bytes.size());
  EXPECT_TRUE(send(10 * kSecond).empty()) << "once, unless somebody lacks them";
}

TEST_F(SnapshotPartsTest, AreSentAgainWhenAnAcknowledgementLacksThemButNotWithinAQuarterOfASecond) {
  parts.start(kEpoch, kStream, 7, content(5 * kPartBytes));
  ASSERT_EQ(send(0).size(), 5U);
  parts.missing(lacks(7, 5, {1, 2, 4, 1}));
  EXPECT_TRUE(send(SnapshotParts::kAgainNs - 1).empty());
  parts.missing(lacks(7, 5, {1, 2, 4, 1}));
  const auto again = send(SnapshotParts::kAgainNs);
  ASSERT_EQ(again.size(), 3U);
  EXPECT_EQ(again[0].part, 1U);
  EXPECT_EQ(again[1].part, 2U);
  EXPECT_EQ(again[2].part, 4U);
  EXPECT_TRUE(send(3 * SnapshotParts::kAgainNs).empty());
}

TEST_F(SnapshotPartsTest, AcknowledgementsOfAnythingElseAreNotListenedTo) {
  parts.start(kEpoch, kStream, 7, content(5 * kPartBytes));
  ASSERT_EQ(send(0).size(), 5U);
  parts.missing(lacks(6, 5, {0, 5}));
  parts.missing(lacks(7, 4, {0, 4}));
  auto other_stream = lacks(7, 5, {0, 5});
  other_stream.stream.generation = 0;
  parts.missing(other_stream);
  auto playing = lacks(7, 5, {0, 5});
  playing.phase = transport::Phase::kPlaying;
  parts.missing(playing);
  EXPECT_TRUE(send(kSecond).empty());
  parts.missing(lacks(7, 5, {4, 0xFFFFFFFF, 0xFFFFFFFF, 1, 2}));
  EXPECT_EQ(send(kSecond).size(), 1U) << "runs are cut to what there is";
}

TEST_F(SnapshotPartsTest, NoMoreThanTheWritersHistoryGoesOutAtOnce) {
  parts.start(kEpoch, kStream, 7, content(100 * kPartBytes));
  EXPECT_EQ(send(0).size(), SnapshotParts::kMostAtOnce);
  EXPECT_TRUE(send(SnapshotParts::kAgainNs - 1).empty());
  const auto rest = send(SnapshotParts::kAgainNs);
  ASSERT_EQ(rest.size(), 36U);
  EXPECT_EQ(rest.front().part, 64U);
}

TEST_F(SnapshotPartsTest, AFullOutboxIsTriedAgain) {
  Outbox narrow({.snapshots = 2});
  SnapshotParts slow(narrow);
  slow.start(kEpoch, kStream, 7, content(3 * kPartBytes));
  slow.send(0);
  EXPECT_EQ(narrow.size(), 2U);
  while (narrow.pop(std::chrono::nanoseconds{0})) {
  }
  slow.send(1);
  EXPECT_EQ(std::get<transport::SnapshotMessage>(*narrow.pop(std::chrono::nanoseconds{0})).part, 2U);
}

TEST_F(SnapshotPartsTest, ANewSnapshotTakesThePlaceOfTheOneBefore) {
  parts.start(kEpoch, kStream, 7, content(2 * kPartBytes));
  ASSERT_EQ(send(0).size(), 2U);
  parts.start(kEpoch, kStream, 8, content(kPartBytes));
  const auto sent = send(1);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].frame, 8U);
  parts.missing(lacks(7, 2, {0, 2}));
  EXPECT_TRUE(send(kSecond).empty());
  parts.forget();
  parts.missing(lacks(8, 1, {0, 1}));
  EXPECT_TRUE(send(2 * kSecond).empty());
}

}  // namespace
}  // namespace tandem::host
