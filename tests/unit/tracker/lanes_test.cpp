// The decoder's loops must read what the format's own code, code_correction(), reads: states depend on it.
#include "sdk/core/codec/tracker/decoder.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "sdk/core/codec/tracker/decision_list.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem::of_lanes {
namespace {

using synthetic::Random;

constexpr std::uint32_t kSlots = 3000;
constexpr std::uint32_t kAllSlots = 2 * kSlots;

// Contexts and models of two blocks.
struct Scene {
  explicit Scene(std::uint64_t seed) : random(seed), contexts(kAllSlots), predicted(kAllSlots) {
    for (std::uint32_t i = 0; i < TrackerModelIndex::kCount; ++i)
      models.p1[i] = static_cast<std::uint16_t>(TrackerModels::kLeast + random.below(65536 - 64));
    std::array<std::vector<std::uint8_t>, 5> columns;
    for (auto& column : columns) {
      column.resize(kAllSlots);
      for (std::uint8_t& value : column) value = static_cast<std::uint8_t>(random.below(8));
    }
    const std::array<const std::uint8_t*, 5> pointers{columns[0].data(), columns[1].data(), columns[2].data(),
                                                      columns[3].data(), columns[4].data()};
    for (std::uint32_t block = 0; block < 2; ++block)
      contexts.fill({block, block * kSlots, kSlots}, predicted, pointers, 100);
  }

  Random random;
  TrackerModels models;
  TrackerContexts contexts;
  State predicted;
};

// A block as it is read.
struct Read {
  std::vector<Slot> slots = std::vector<Slot>(kSlots);
  std::vector<TrackerCorrection> corrections = std::vector<TrackerCorrection>(kSlots);
  TrackerCounts counts{};

  DecodingLane lane(Slot first, std::span<const std::byte> bytes, std::uint32_t corrected) {
    return {LaneDecoder(bytes), first, kSlots, corrected, slots.data(), corrections.data(), &counts, nullptr};
  }
};

// Reads `bytes` by code_correction() and compares. Returns false if it refuses them.
bool reads_the_same(const Scene& scene, std::span<const std::byte> bytes, const DecodingLane& lane,
                    const Read& read) {
  TrackerCounts counts{};
  DecisionDecoder decoder{RangeDecoder(bytes), &scene.models, &counts};
  for (std::uint32_t i = 0; i < lane.corrected; ++i) {
    TrackerCorrection correction;
    if (!code_correction(decoder, scene.contexts.of(read.slots[i]), correction)) return false;
    EXPECT_EQ(correction.steps, read.corrections[i].steps) << i;
    EXPECT_EQ(correction.rest, read.corrections[i].rest) << i;
  }
  for (std::uint32_t model = 0; model < TrackerModelIndex::kOfPositions; ++model)
    EXPECT_EQ(counts[model], read.counts[model]) << model;
  EXPECT_EQ(lane.decoder.at == lane.decoder.end, decoder.range.at_end());
  return true;
}

TEST(TrackerLanes, ReadTheCorrectionsOfTwoBlocksSideBySide) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Scene scene(seed);
    std::array<Read, 2> read;
    std::array<std::vector<std::byte>, 2> bytes;
    std::array<DecodingLane, 2> lanes;
    for (std::uint32_t block = 0; block < 2; ++block) {
      std::uint32_t count = 0;
      bytes[block].resize(kSlots * (kMaxCorrectionBits / 8 + 1));
      RangeEncoder coder(bytes[block]);
      DecisionList list;
      TrackerCounts counted{};
      ListedCounts counts{counted, {}};
      for (Slot slot = block * kSlots; slot < (block + 1) * kSlots; ++slot) {
        if (!scene.random.one_in(2 + block)) continue;
        TrackerCorrection correction;
        correction.rest = scene.random.one_in(4);
        for (std::int32_t& step : correction.steps)
          step = scene.random.one_in(3)
                     ? 0
                     : scene.random.value(scene.random.one_in(20) ? kMaxTrackerSteps : 100);
        if (!is_some(correction.steps)) correction.steps[2] = -1;
        list.add(scene.contexts.of(slot), correction, counts);
        coder.put_all(list.decisions(), scene.models.p1.data());
        list.clear();
        read[block].slots[count++] = slot;
      }
      bytes[block].resize(coder.finish());
      lanes[block] = read[block].lane(block * kSlots, bytes[block], count);
    }
    ASSERT_TRUE(read_corrections(lanes, scene.contexts, scene.models.p1.data()));
    for (std::size_t block = 0; block < 2; ++block)
      EXPECT_TRUE(reads_the_same(scene, bytes[block], lanes[block], read[block]));
  }
}

TEST(TrackerLanes, ReadAnyBytesAsTheFormatSays) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Scene scene(seed);
    Read read;
    std::vector<std::byte> bytes(1 + scene.random.below(300));
    const bool is_full = seed % 10 == 0;  // the code is as large as the range then
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(is_full ? 255 : scene.random.below(256));
    const auto corrected = static_cast<std::uint32_t>(1 + scene.random.below(200));
    for (std::uint32_t i = 0; i < corrected; ++i) read.slots[i] = i;
    std::array<DecodingLane, 1> lanes{read.lane(0, bytes, corrected)};
    if (read_corrections(lanes, scene.contexts, scene.models.p1.data())) {
      EXPECT_TRUE(reads_the_same(scene, bytes, lanes[0], read));
    } else {
      DecisionDecoder decoder{RangeDecoder(bytes), &scene.models, &read.counts};
      bool good = true;
      for (std::uint32_t i = 0; i < corrected && good; ++i) {
        TrackerCorrection correction;
        good = code_correction(decoder, scene.contexts.of(i), correction);
      }
      EXPECT_FALSE(good);
    }
  }
}

TEST(TrackerLanes, ReadFlagsAloneSideBySideAndGuessed) {
  Scene scene(5);
  std::vector<std::uint16_t> flags(kAllSlots);
  for (std::uint16_t& flag : flags)
    flag = static_cast<std::uint16_t>(scene.random.below(TrackerModelIndex::kRest));
  for (std::size_t i = 0; i < flags.size(); i += 7) flags[i] = TrackerModelIndex::kDead;
  std::array<std::vector<std::byte>, 2> bytes{std::vector<std::byte>(900), std::vector<std::byte>(400)};
  for (auto& block : bytes) {
    for (std::byte& byte : block) byte = static_cast<std::byte>(scene.random.below(256));
  }
  const std::uint16_t* const p1 = scene.models.p1.data();
  std::array<Read, 2> together, alone;
  std::array<DecodingLane, 2> lanes{together[0].lane(0, bytes[0], 0), together[1].lane(kSlots, bytes[1], 0)};
  lanes[1].slots -= 100;
  for (DecodingLane& lane : lanes) lane.flags = flags.data() + lane.first;
  read_flags(lanes, p1, false);
  for (std::size_t block = 0; block < 2; ++block) {
    std::array<DecodingLane, 1> one{alone[block].lane(static_cast<Slot>(block) * kSlots, bytes[block], 0)};
    one[0].slots = lanes[block].slots;
    one[0].flags = flags.data() + one[0].first;
    read_flags(one, p1, true);
    EXPECT_EQ(one[0].corrected, lanes[block].corrected);
    EXPECT_EQ(one[0].decoder.code, lanes[block].decoder.code);
    for (std::uint32_t i = 0; i < one[0].corrected; ++i)
      EXPECT_EQ(alone[block].slots[i], together[block].slots[i]);
  }
}

}  // namespace
}  // namespace tandem::of_lanes
