#include "sdk/client/following/snapshot_assembly.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "sdk/wire/limits.hpp"

namespace tandem::client::of_snapshot_assembly {
namespace {

using Outcome = SnapshotAssembly::Outcome;
using Runs = std::vector<std::uint32_t>;

constexpr std::size_t kMaxBytes = 1000;

transport::Bytes content(std::size_t size, unsigned first = 0) {
  transport::Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>((first + i) % 251);
  return bytes;
}

/// `whole` in parts of `step` bytes.
std::vector<transport::SnapshotMessage> cut(Frame frame, const transport::Bytes& whole, std::size_t step) {
  std::vector<transport::SnapshotMessage> parts((whole.size() + step - 1) / step);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto begin = whole.begin() + static_cast<std::ptrdiff_t>(i * step);
    parts[i].epoch = 5;
    parts[i].frame = frame;
    parts[i].part = static_cast<std::uint32_t>(i);
    parts[i].parts = static_cast<std::uint32_t>(parts.size());
    parts[i].total_bytes = static_cast<std::uint32_t>(whole.size());
    parts[i].bytes.assign(begin,
                          begin + static_cast<std::ptrdiff_t>(std::min(step, whole.size() - i * step)));
  }
  return parts;
}

Outcome add(SnapshotAssembly& assembly, transport::SnapshotMessage part) {
  return assembly.add(std::move(part));
}

TEST(SnapshotAssembly, JoinsPartsThatComeInAnyOrderAndOften) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    const auto whole = content(kMaxBytes, seed);
    auto parts = cut(9, whole, 1 + random() % 400);
    const auto twice = parts;
    parts.insert(parts.end(), twice.begin(), twice.end());
    std::shuffle(parts.begin(), parts.end(), random);
    SnapshotAssembly assembly(kMaxBytes);
    for (const auto& part : parts) EXPECT_NE(add(assembly, part), Outcome::kRefused) << "seed " << seed;
    const auto joined = assembly.take();
    ASSERT_TRUE(joined.has_value()) << "seed " << seed;
    EXPECT_EQ(joined->bytes, whole);
    EXPECT_EQ(joined->epoch, 5U);
    EXPECT_EQ(joined->frame, 9U);
    EXPECT_EQ(joined->part, 0U);
    EXPECT_EQ(joined->parts, 1U);
    EXPECT_EQ(joined->total_bytes, kMaxBytes);
  }
}

TEST(SnapshotAssembly, IsHandedOutOnceAndThenCountsAsHeld) {
  SnapshotAssembly assembly(kMaxBytes);
  auto parts = cut(9, content(20), 20);
  EXPECT_EQ(add(assembly, parts[0]), Outcome::kStored);
  EXPECT_TRUE(assembly.take().has_value());
  EXPECT_FALSE(assembly.take().has_value());
  EXPECT_EQ(add(assembly, parts[0]), Outcome::kIgnored);
  EXPECT_EQ(assembly.parts(), 1U);
  EXPECT_TRUE(assembly.missing().empty());
  assembly.clear();
  EXPECT_EQ(assembly.parts(), 0U);
  EXPECT_EQ(add(assembly, parts[0]), Outcome::kStored);
  EXPECT_TRUE(assembly.take().has_value());
}

TEST(SnapshotAssembly, ANewerFrameTakesThePlaceOfAnOlderOneAndNeverTheOtherWayRound) {
  SnapshotAssembly assembly(kMaxBytes);
  const auto old = cut(9, content(20), 10);
  const auto young = cut(10, content(30), 10);
  EXPECT_EQ(add(assembly, old[0]), Outcome::kStored);
  EXPECT_EQ(add(assembly, young[2]), Outcome::kStored);
  EXPECT_EQ(assembly.frame(), 10U);
  EXPECT_EQ(assembly.missing(), (Runs{0, 2}));
  EXPECT_EQ(add(assembly, old[1]), Outcome::kIgnored);
  EXPECT_EQ(add(assembly, young[0]), Outcome::kStored);
  EXPECT_EQ(add(assembly, young[1]), Outcome::kStored);
  EXPECT_EQ(assembly.take()->bytes, content(30));
}

TEST(SnapshotAssembly, PartsThatDisagreeWithThoseHeldAreIgnored) {
  SnapshotAssembly assembly(kMaxBytes);
  const auto parts = cut(9, content(20), 10);
  EXPECT_EQ(add(assembly, parts[0]), Outcome::kStored);
  auto other = parts[1];
  other.parts = 3;
  EXPECT_EQ(add(assembly, other), Outcome::kIgnored);
  other = parts[1];
  other.total_bytes = 21;
  EXPECT_EQ(add(assembly, other), Outcome::kIgnored);
  EXPECT_EQ(add(assembly, parts[1]), Outcome::kStored);
  EXPECT_TRUE(assembly.take().has_value());
}

TEST(SnapshotAssembly, WhatBreaksARuleDropsAll) {
  const auto parts = cut(9, content(30), 10);
  const auto refused = [&](auto&& change) {
    SnapshotAssembly assembly(kMaxBytes);
    EXPECT_EQ(add(assembly, parts[0]), Outcome::kStored);
    EXPECT_EQ(add(assembly, parts[2]), Outcome::kStored);
    auto part = parts[1];
    change(part);
    return add(assembly, part) == Outcome::kRefused && assembly.parts() == 0;
  };
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_TRUE(refused([](auto& p) { p.parts = 0; }));
  EXPECT_TRUE(refused([](auto& p) { p.part = p.parts; }));
  EXPECT_TRUE(refused([](auto& p) { p.parts = transport::kMaxSnapshotParts + 1; }));
  EXPECT_TRUE(refused([](auto& p) { p.parts = p.total_bytes + 1; }));
  EXPECT_TRUE(refused([](auto& p) { p.bytes.clear(); }));
  EXPECT_TRUE(refused([](auto& p) { p.bytes.resize(9); })) << "all parts, fewer bytes";
  EXPECT_TRUE(refused([](auto& p) { p.bytes.resize(11); })) << "more bytes than there are";
  EXPECT_TRUE(refused([](auto& p) { p.bytes.resize(31); }));
  EXPECT_TRUE(refused([](auto& p) { p.total_bytes = kMaxBytes + 1; }));
}

TEST(SnapshotAssembly, HoldsNoMoreThanTheStreamDeclares) {
  SnapshotAssembly assembly(kMaxBytes);
  const auto parts = cut(9, content(kMaxBytes + 1), 100);
  for (const auto& part : parts) EXPECT_EQ(add(assembly, part), Outcome::kRefused);
  EXPECT_EQ(assembly.parts(), 0U);
}

TEST(SnapshotAssembly, NamesTheFirst32RunsOfWhatIsMissing) {
  SnapshotAssembly assembly(kMaxBytes);
  EXPECT_TRUE(assembly.missing().empty()) << "nothing is coming in";
  const auto parts = cut(9, content(100), 1);
  for (std::size_t i = 1; i < 100; i += 2) EXPECT_EQ(add(assembly, parts[i]), Outcome::kStored);
  const auto runs = assembly.missing();
  ASSERT_EQ(runs.size(), 64U);
  for (std::uint32_t i = 0; i < 32; ++i) {
    EXPECT_EQ(runs[2 * i], 2 * i);
    EXPECT_EQ(runs[2 * i + 1], 1U);
  }
}

}  // namespace
}  // namespace tandem::client::of_snapshot_assembly
