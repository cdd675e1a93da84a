#include "sdk/wire/parcels.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/standby_messages.hpp"

namespace tandem::transport {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Bytes content(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i % 251);
  return bytes;
}

TEST(Cutting, TheLastPartIsTheSmaller) {
  EXPECT_EQ(part_count(20, 10), 2U);
  EXPECT_EQ(part_count(21, 10), 3U);
  EXPECT_EQ(part_count(0, 10), 1U) << "an empty one";
  const Bytes whole = content(21);
  EXPECT_THAT(part_of(whole, 10, 2), ElementsAre(whole[20]));
  EXPECT_EQ(part_of(whole, 10, 1).size(), 10U);
  EXPECT_THAT(part_of({}, 10, 0), IsEmpty());
}

TEST(MissingRuns, SayWhatIsHeld) {
  std::mt19937 random(1);
  for (int times = 0; times < 200; ++times) {
    std::vector<bool> held(1 + random() % 40);
    for (auto&& one : held) one = random() % 3 != 0;
    const auto runs = missing_runs(held);
    ASSERT_LE(runs.size(), 2 * kMaxMissingRuns);
    if (runs.size() < 2 * kMaxMissingRuns) {
      EXPECT_EQ(held_parts(runs, held.size()), held);
    }
  }
}

TEST(MissingRuns, TheFirst32AreTold) {
  std::vector<bool> held(100);
  for (std::size_t i = 0; i < 100; i += 2) held[i] = true;
  const auto runs = missing_runs(held);
  EXPECT_EQ(runs.size(), 64U);
  std::fill(held.begin() + 64, held.end(), false);
  EXPECT_EQ(held_parts(runs, held.size()), held) << "and nothing is known of what is behind them";
}

TEST(MissingRuns, ThatMakeNoSenseNameNoPartThatIsNotThere) {
  const std::vector<std::uint32_t> wild{7, UINT32_MAX, UINT32_MAX, UINT32_MAX, 2, 1, 5};
  EXPECT_THAT(held_parts(wild, 8), ElementsAre(true, true, false, true, true, true, true, false));
  EXPECT_THAT(held_parts(wild, 0), IsEmpty());
}

template <class M>
class ParcelsTest : public ::testing::Test {
 protected:
  static M part(Frame frame, std::uint32_t number, std::uint32_t parts = 3) {
    M message;
    message.epoch = 5;
    message.frame = frame;
    message.part = number;
    message.parts = parts;
    message.total_bytes = 2 * parts;
    message.bytes.assign(2, static_cast<std::byte>(number));
    return message;
  }
  ParcelOutcome add(M message) { return parcels.add(std::move(message)); }

  static constexpr auto kStored = ParcelOutcome::kStored;
  static constexpr auto kIgnored = ParcelOutcome::kIgnored;
  static constexpr auto kRefused = ParcelOutcome::kRefused;
  Parcels<M> parcels;
};
using InParts = ::testing::Types<SnapshotMessage, CheckpointMessage>;
TYPED_TEST_SUITE(ParcelsTest, InParts);

TYPED_TEST(ParcelsTest, WhatWasCutBecomesWholeInAnyOrder) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const Bytes whole = content(1 + random() % 1000);
    const std::size_t part_bytes = 1 + random() % 400;
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < part_count(whole.size(), part_bytes); ++i) order.insert(order.end(), 2, i);
    std::shuffle(order.begin(), order.end(), random);
    Parcels<TypeParam> all;
    TypeParam message = TestFixture::part(9, 0);
    for (const std::size_t i : order) {
      cut_part(whole, part_bytes, i, message);
      EXPECT_NE(all.add(TypeParam(message)), ParcelOutcome::kRefused);
    }
    EXPECT_THAT(all.missing(), IsEmpty());
    const auto joined = all.take();
    ASSERT_TRUE(joined) << "seed " << seed;
    cut_part(whole, whole.size(), 0, message);
    EXPECT_EQ(*joined, message) << "as one part";
  }
}

TYPED_TEST(ParcelsTest, IsHandedOutOnceAndThenCountsAsHeld) {
  EXPECT_EQ(this->add(this->part(5, 2)), this->kStored);
  EXPECT_THAT(this->parcels.missing(), ElementsAre(0, 2));
  EXPECT_EQ(this->add(this->part(5, 0)), this->kStored);
  EXPECT_EQ(this->add(this->part(5, 0)), this->kIgnored) << "again";
  EXPECT_THAT(this->parcels.missing(), ElementsAre(1, 1));
  EXPECT_FALSE(this->parcels.take());
  EXPECT_EQ(this->add(this->part(5, 1)), this->kStored);
  EXPECT_TRUE(this->parcels.take());
  EXPECT_FALSE(this->parcels.take());
  EXPECT_EQ(this->add(this->part(5, 1)), this->kIgnored);
  EXPECT_EQ(this->parcels.parts(), 3U);
  this->parcels.clear();
  EXPECT_EQ(this->parcels.parts(), 0U);
  EXPECT_EQ(this->parcels.frame(), 0U);
  EXPECT_THAT(this->parcels.missing(), IsEmpty());
}

TYPED_TEST(ParcelsTest, ANewerFrameBeginsAnewAndAnOlderOneIsPassedOver) {
  EXPECT_EQ(this->add(this->part(5, 0)), this->kStored);
  EXPECT_EQ(this->add(this->part(6, 1)), this->kStored);
  EXPECT_EQ(this->parcels.frame(), 6U);
  EXPECT_EQ(this->add(this->part(5, 2)), this->kIgnored);
  EXPECT_EQ(this->add(this->part(6, 0)), this->kStored);
  EXPECT_EQ(this->add(this->part(6, 2)), this->kStored);
  EXPECT_TRUE(this->parcels.take());
}

TYPED_TEST(ParcelsTest, PartsThatDoNotFitAreNotTaken) {
  EXPECT_EQ(this->add(this->part(5, 0)), this->kStored);
  EXPECT_EQ(this->add(this->part(5, 1, 2)), this->kIgnored);
  EXPECT_EQ(this->add(this->part(5, 3)), this->kIgnored) << "there is no such part";
  auto long_part = this->part(5, 1);
  long_part.bytes.resize(5);
  EXPECT_EQ(this->add(long_part), this->kRefused) << "more than the whole has";
  EXPECT_THAT(this->parcels.missing(), ElementsAre(1, 2));
  EXPECT_EQ(this->parcels.held_bytes(), 2U);
}

TEST(Parcels, OfACheckpointHaveOneJournal) {
  Parcels<CheckpointMessage> parcels;
  CheckpointMessage part{
      .epoch = 5, .frame = 1, .journal = 7, .parts = 2, .total_bytes = 2, .bytes = Bytes(1)};
  EXPECT_EQ(parcels.add(CheckpointMessage(part)), ParcelOutcome::kStored);
  part.part = 1;
  part.journal = 8;
  EXPECT_EQ(parcels.add(CheckpointMessage(part)), ParcelOutcome::kIgnored);
  part.journal = 7;
  EXPECT_EQ(parcels.add(std::move(part)), ParcelOutcome::kStored);
  EXPECT_EQ(parcels.take()->journal, 7U);
}

}  // namespace
}  // namespace tandem::transport
