#include "sdk/core/codec/range_coder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/codec/tracker/decision_list.hpp"
#include "sdk/core/codec/tracker/models.hpp"

namespace tandem {
namespace {

using Bytes = std::vector<std::byte>;

struct Decision {
  bool bit;
  std::uint32_t p1;
};

std::vector<Decision> random_decisions(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 random(seed);
  std::vector<Decision> decisions;
  for (std::size_t i = 0; i < count; ++i) {
    // Every order of magnitude of rarity, on both sides.
    std::uint32_t p1 = std::max<std::uint32_t>(1, 65535U >> (random() % 16U));
    if (random() % 2 == 0) p1 = 65536 - p1;
    decisions.push_back({random() % 65536U < p1, p1});
  }
  return decisions;
}

double ideal_bits(const std::vector<Decision>& decisions) {
  double bits = 0;
  for (const Decision& d : decisions) bits -= std::log2((d.bit ? d.p1 : 65536 - d.p1) / 65536.0);
  return bits;
}

Bytes encode(const std::vector<Decision>& decisions) {
  Bytes out(8 * decisions.size() + 8);
  RangeEncoder encoder(out);
  for (const Decision& d : decisions) encoder.put(d.bit, d.p1);
  out.resize(encoder.finish());
  EXPECT_FALSE(encoder.overflow());
  return out;
}

TEST(RangeCoder, DecodesWhatWasEncoded) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const auto decisions = random_decisions(seed, seed * 7);
    const Bytes bytes = encode(decisions);
    RangeDecoder decoder(bytes);
    for (const Decision& d : decisions) ASSERT_EQ(decoder.get(d.p1), d.bit);
    EXPECT_TRUE(decoder.at_end());
  }
}

TEST(RangeCoder, StaysWithinOnePercentOfTheIdealLength) {
  const auto decisions = random_decisions(1, 200'000);
  const double ideal = ideal_bits(decisions);
  const double real = 8.0 * static_cast<double>(encode(decisions).size());
  EXPECT_GE(real + 0.01, ideal);
  EXPECT_LT(real, 1.001 * ideal + 16);
}

TEST(RangeCoder, LikelyDecisionsAndNoneAtAllTakeNoBytes) {
  EXPECT_TRUE(encode({}).empty());
  EXPECT_TRUE(encode(std::vector<Decision>(20, {true, 65504})).empty());
}

TEST(RangeCoder, CarriesThroughRunsOfFullBytes) {
  // A long run just below a boundary, then a decision that pushes low over it.
  for (std::size_t run = 1; run < 60; ++run) {
    std::vector<Decision> decisions(run, {false, 1});
    decisions.push_back({false, 65535});
    decisions.push_back({false, 65535});
    decisions.push_back({true, 1});
    const Bytes bytes = encode(decisions);
    RangeDecoder decoder(bytes);
    for (const Decision& d : decisions) ASSERT_EQ(decoder.get(d.p1), d.bit) << run;
    EXPECT_TRUE(decoder.at_end());
  }
}

TEST(RangeCoder, NeverWritesBeyondItsMemory) {
  const auto decisions = random_decisions(2, 1000);
  const Bytes whole = encode(decisions);
  for (std::size_t size = 0; size < whole.size() + 3; ++size) {
    Bytes out(size + 1, std::byte{0xA5});
    RangeEncoder encoder{std::span(out).first(size)};
    for (const Decision& d : decisions) encoder.put(d.bit, d.p1);
    const std::size_t written = encoder.finish();
    EXPECT_EQ(out.back(), std::byte{0xA5});
    if (!encoder.overflow()) {
      EXPECT_EQ(Bytes(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(written)), whole);
    } else {
      EXPECT_LT(size, whole.size() + 4);
    }
  }
}

TEST(RangeCoder, TheDecoderReadsZerosBeyondItsBytesAndSeesLeftOnes) {
  RangeDecoder nothing{{}};
  for (int i = 0; i < 100'000; ++i) nothing.get(1 + static_cast<std::uint32_t>(i) % 65535U);
  EXPECT_TRUE(nothing.at_end());
  const Bytes more(100, std::byte{1});
  RangeDecoder early(more);
  early.get(32768);
  EXPECT_FALSE(early.at_end());
  // A zero at the end could have been left out, so nobody wrote it.
  const Bytes padded{std::byte{7}, std::byte{0}};
  EXPECT_FALSE(RangeDecoder(padded).at_end());
}

TEST(TrackerModels, LearnTheShareOfOnesAndStayInTheirRange) {
  TrackerModels models;
  TrackerCounts counts{};
  counts[0] = {0, 500};
  counts[1] = {500, 0};
  counts[2] = {375, 125};
  for (int delta = 0; delta < 40; ++delta) models.learn(counts, TrackerModelIndex::kCount);
  EXPECT_EQ(models.p1[0], TrackerModels::kMax);
  EXPECT_EQ(models.p1[1], TrackerModels::kLeast);
  EXPECT_NEAR(models.p1[2], 16384, 16);
  EXPECT_EQ(models.p1[3], TrackerModels::kRare);
  EXPECT_EQ(models.weight[3], 0);
  EXPECT_EQ(models.weight[2], 255);
}

TEST(TrackerModels, YoungOnesLearnFasterThanThoseThatHaveSeenMuch) {
  TrackerModels models;
  TrackerCounts once{};
  once[TrackerModelIndex::kSteps] = {0, 3};
  models.learn(once, TrackerModelIndex::kCount);
  EXPECT_EQ(models.p1[TrackerModelIndex::kSteps], (32768 + 3 * 65536) / 4);
  TrackerCounts often{};
  often[TrackerModelIndex::kSteps] = {1000, 0};
  models.learn(often, TrackerModelIndex::kCount);
  models.learn(once, TrackerModelIndex::kCount);
  EXPECT_LT(models.p1[TrackerModelIndex::kSteps], 1500);
}

// Codes one decision after the other, as the format says; the encoder lists them first.
struct DecisionEncoder {
  bool code(bool bit, std::uint32_t model) {
    range.put(bit, models->p1[model]);
    ++(*counts)[model][bit ? 1 : 0];
    return bit;
  }
  bool code_sign(bool bit, std::uint32_t model) { return code(bit, model); }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }
  RangeEncoder range;
  const TrackerModels* models = nullptr;
  TrackerCounts* counts = nullptr;
};

struct Coded {
  Bytes bytes;
  TrackerCounts counts{};
};

template <class Code>
Coded coded(std::size_t room, const TrackerModels& models, const Code& code) {
  Coded result{Bytes(room), {}};
  DecisionEncoder coder{RangeEncoder(result.bytes), &models, &result.counts};
  code(coder);
  result.bytes.resize(coder.range.finish());
  EXPECT_FALSE(coder.range.overflow());
  return result;
}

TEST(TrackerModels, StepsOfEverySizeSurviveTheCoder) {
  std::mt19937_64 random(4);
  std::vector<TrackerSteps> all{
      {0, 0, 1}, {kMaxTrackerSteps, -kMaxTrackerSteps, kMaxTrackerSteps}, {14, 15, 16}};
  for (int i = 0; i < 2000; ++i) {
    TrackerSteps steps{};
    for (std::int32_t& s : steps) s = static_cast<std::int32_t>(random() & 0xFFFFFFFFU) >> (random() % 32U);
    for (std::int32_t& s : steps) s = std::clamp(s, -kMaxTrackerSteps, kMaxTrackerSteps);
    if (steps != TrackerSteps{}) all.push_back(steps);
  }
  const TrackerModels models;
  const Coded out = coded(all.size() * (kMaxCorrectionBits / 8 + 1), models, [&all](DecisionEncoder& coder) {
    for (TrackerSteps steps : all) code_steps(coder, {}, steps);
  });
  TrackerCounts counts{};
  DecisionDecoder decoder{RangeDecoder(out.bytes), &models, &counts};
  for (const TrackerSteps& expected : all) {
    TrackerSteps steps{};
    ASSERT_TRUE(code_steps(decoder, {}, steps));
    ASSERT_EQ(steps, expected);
  }
  EXPECT_TRUE(decoder.range.at_end());
  EXPECT_EQ(counts, out.counts);
}

TEST(TrackerModels, AListOfDecisionsIsCodedAsOneAfterTheOther) {
  constexpr std::uint64_t kSeed = 6;
  std::mt19937_64 random(kSeed);
  TrackerModels models;
  for (std::uint32_t i = 0; i < TrackerModelIndex::kCount; ++i)
    models.p1[i] = static_cast<std::uint16_t>(TrackerModels::kLeast + random() % 65473U);
  std::vector<std::pair<TrackerContext, TrackerCorrection>> all(3000);
  for (auto& [context, correction] : all) {
    context.rest = TrackerModelIndex::kRest + static_cast<std::uint32_t>(random() % 30U);
    context.zero = static_cast<std::uint32_t>(random() % 20U);
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const auto sign = (axis * 27 + static_cast<std::uint32_t>(random() % 27U)) * 4;
      context.sign[axis] = context.steps + TrackerModelIndex::kSign + sign;
      context.magnitude[axis] = static_cast<std::uint32_t>(random() % 15U);
      context.moved_last[axis] = static_cast<std::uint32_t>(random() % 2U);
    }
    for (std::int32_t& s : correction.steps) {
      s = static_cast<std::int32_t>(random() & 0xFFFFFFFFU) >> (random() % 32U);
      s = std::clamp(random() % 3U == 0 ? 0 : s, -kMaxTrackerSteps, kMaxTrackerSteps);
    }
    if (!is_some(correction.steps)) correction.steps[2] = -1;
    correction.rest = random() % 4U == 0;
  }
  const std::size_t room = all.size() * (kMaxCorrectionBits / 8 + 1);
  const Coded expected = coded(room, models, [&all](DecisionEncoder& coder) {
    for (auto& [context, correction] : all) code_correction(coder, context, correction);
  });
  Coded listed{Bytes(room), {}};
  RangeEncoder coder(listed.bytes);
  DecisionList list;
  ListedCounts counts{listed.counts, {}};
  const auto code = [&] {
    coder.put_all(list.decisions(), models.p1.data());
    list.clear();
  };
  for (const auto& [context, correction] : all) {
    if (list.is_full()) code();
    list.add(context, correction, counts);
  }
  code();
  listed.bytes.resize(coder.finish());
  counts.sizes.add_to(listed.counts);
  listed.counts[TrackerModelIndex::kDead] = {};  // what was not coded
  EXPECT_EQ(listed.bytes, expected.bytes);
  EXPECT_EQ(listed.counts, expected.counts);
}

// Adds up the ideal lengths of decisions under the models that the range coder is given.
struct IdealCoder {
  const TrackerModels* models;
  double bits = 0;
  bool code(bool bit, std::uint32_t model) {
    const double p1 = models->p1[model] / 65536.0;
    bits -= std::log2(bit ? p1 : 1 - p1);
    return bit;
  }
  bool code_sign(bool bit, std::uint32_t model) { return code(bit, model); }
  bool code_even(bool bit) {
    bits += 1;
    return bit;
  }
};

TrackerContext context_of(const TrackerBody& body) {
  const std::array<std::uint8_t, 5> columns{static_cast<std::uint8_t>(body.age),
                                            static_cast<std::uint8_t>(body.interval), 0, 0, 0};
  TrackerContexts contexts(1);
  contexts.fill({0, 0, 1}, State(1), {&columns[0], &columns[1], &columns[2], &columns[3], &columns[4]}, 100);
  return contexts.of(0);
}

// Bodies of a block, one in `corrected_one_in` corrected by short steps; as Tracker codes them.
template <class Coder>
void code_block(Coder& coder, std::uint64_t seed, std::uint64_t corrected_one_in) {
  std::mt19937_64 random(seed);
  std::vector<TrackerBody> corrected;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const TrackerBody body{
        static_cast<std::uint32_t>(random() % 20U), static_cast<std::uint32_t>(random() % 20U), {}};
    const bool is_corrected = random() % corrected_one_in == 0;
    coder.code(is_corrected, flag_model(body.age, flag_history(body), false));
    if (is_corrected) corrected.push_back(body);
  }
  for (const TrackerBody& body : corrected) {
    TrackerSteps steps{1, 0, 0};
    for (std::int32_t& step : steps) step = static_cast<std::int32_t>(random() % 5U) - 2;
    if (steps == TrackerSteps{}) steps[0] = 20;
    code_steps(coder, context_of(body), steps);
  }
}

TEST(TrackerModels, SectionsStayWithinOnePercentOfTheIdealLengthOfTheirModels) {
  for (const std::uint64_t corrected_one_in : {2U, 6U, 30U}) {
    constexpr std::uint64_t kSeed = 5;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", one in " << corrected_one_in);
    TrackerModels models;
    double ideal_bits = 0;
    double real_bits = 0;
    for (std::uint64_t frame = 0; frame < 50; ++frame) {
      IdealCoder ideal{&models};
      code_block(ideal, kSeed + frame, corrected_one_in);
      ideal_bits += ideal.bits;
      const Coded out = coded(100'000, models, [&](DecisionEncoder& coder) {
        code_block(coder, kSeed + frame, corrected_one_in);
      });
      real_bits += 8.0 * static_cast<double>(out.bytes.size());
      models.learn(out.counts, TrackerModelIndex::kCount);
    }
    EXPECT_GE(real_bits, ideal_bits);
    EXPECT_LT(real_bits, 1.01 * ideal_bits);
    RecordProperty("excess_ppm_one_in_" + std::to_string(corrected_one_in),
                   static_cast<int>(1e6 * (real_bits / ideal_bits - 1)));
  }
}

}  // namespace
}  // namespace tandem
