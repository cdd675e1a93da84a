#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/codec_table.hpp"

#include <gtest/gtest.h>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::codec_of;

constexpr CodecParameters kParameters{100, 10, 20};

struct Encoded {
  std::vector<std::byte> bytes;
  std::vector<Slot> corrected;
};

Encoded encode(Codec& codec, State& state, const State& target, std::size_t budget = kNoBudget) {
  Encoded encoded{std::vector<std::byte>(codec.bound()), {}};
  ByteWriter out(encoded.bytes);
  const CodecFrame frame{state, state.alive(), {}, kParameters};
  const Corrections corrections = codec.encode(frame, target, budget, out, nullptr);
  EXPECT_FALSE(out.overflow());
  encoded.bytes.resize(out.size());
  encoded.corrected.assign(corrections.slots.begin(), corrections.slots.end());
  codec.apply(corrections, state);
  return encoded;
}

State bodies_at_rest(std::uint32_t count) {
  State state(count);
  for (Slot slot = 0; slot < count; ++slot) state.spawn(slot, 0, 0, {});
  return state;
}

TEST(MakeCodec, KnowsTheNamesOfThePaperInItsOrderAndOurs) {
  const auto names = codec_names();
  EXPECT_EQ(
      std::vector<std::string_view>(names.begin(), names.end()),
      (std::vector<std::string_view>{"none", "selective", "quantized", "entropy", "limited", "tracker"}));
  for (const std::string_view name : names) EXPECT_EQ(codec_of(name, 5)->name(), name);
}

TEST(MakeCodec, RefusesUnknownNamesWrongTablesAndCapacities) {
  EXPECT_EQ(make_codec({.name = "zip", .capacity = 10}).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(make_codec({.name = "entropy", .capacity = 10}).error().code, ErrorCode::kMalformed);
  EXPECT_EQ(make_codec({.name = "none", .capacity = 0}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(make_codec({.name = "none", .capacity = kMaxCapacity + 1}).error().code,
            ErrorCode::kInvalidArgument);
  auto tables = default_code_tables();
  const auto code = [&tables](std::string_view name) {
    return make_codec({.name = name, .capacity = 10, .tables = tables}).error().code;
  };
  EXPECT_EQ(code("selective"), ErrorCode::kMalformed);
  tables[300] = std::byte{0};
  EXPECT_EQ(code("limited"), ErrorCode::kMalformed);
}

TEST(CodecTraits, SayWhatACodecTakesAndReads) {
  EXPECT_EQ(codec_traits("zip").error().code, ErrorCode::kUnsupported);
  EXPECT_FALSE(codec_traits("none")->reads_threshold);
  EXPECT_FALSE(codec_traits("selective")->reads_steps);
  EXPECT_TRUE(codec_traits("entropy")->reads_steps && codec_traits("entropy")->takes_tables);
  EXPECT_EQ(codec_traits("limited")->usual_budget, kPaperBudgetBytes);
  EXPECT_TRUE(codec_traits("tracker")->takes_budget && codec_traits("tracker")->reads_gains);
  for (const std::string_view name : codec_names())
    EXPECT_EQ(codec_traits(name)->is_baseline, name != "tracker") << name;
}

TEST(Codec, WhatIsWithinTheThresholdCostsNothing) {
  State state = bodies_at_rest(100);
  State target = state;
  target.p(0)[3] = 100;
  target.v(0)[4] = 1 << 20;
  for (const std::string_view name : codec_names()) {
    if (name == "none") continue;
    EXPECT_TRUE(encode(*codec_of(name, 100), state, target).bytes.empty()) << name;
  }
  EXPECT_EQ(state, bodies_at_rest(100));
}

TEST(Codec, TheErrorIsEuclidean) {
  State state = bodies_at_rest(3);
  State target = state;
  for (std::size_t i = 0; i < 3; ++i) {
    target.p(i)[0] = 57;  // 57 * sqrt(3) = 98.7
    target.p(i)[1] = 58;  // 100.5
  }
  EXPECT_EQ(encode(*codec_of("selective", 3), state, target).corrected, std::vector<Slot>{1});
}

TEST(Codec, NoneIsWithinATenthOfAPercentOf24BytesABody) {
  for (const std::uint32_t bodies : {5000U, 10000U, 20000U}) {
    State state = bodies_at_rest(bodies);
    const State target = state;
    const auto size = static_cast<double>(encode(*codec_of("none", bodies), state, target).bytes.size());
    EXPECT_GE(size, 24.0 * bodies);
    EXPECT_LE(size, 24.024 * bodies);
  }
}

TEST(Codec, SelectiveSpends24BytesAndATwoByteIndexOnABody) {
  State state = bodies_at_rest(10000);
  State target = state;
  for (Slot slot = 0; slot < 100; ++slot) target.p(1)[slot * 77] = 5000;
  EXPECT_EQ(encode(*codec_of("selective", 10000), state, target).bytes.size(), 1 + 2 + 2 + 2 + 100 * 26U);
  EXPECT_EQ(state, target);
}

TEST(Codec, QuantizedRoundsToItsSteps) {
  State state = bodies_at_rest(2);
  State target = state;
  target.p(0)[1] = 994;
  target.p(1)[1] = -996;
  target.v(2)[1] = 29;
  EXPECT_EQ(encode(*codec_of("quantized", 2), state, target).bytes.size(), 4 + 1 + 6U);
  EXPECT_EQ(state.body(1), (BodyState{{990, -1000, 0}, {0, 0, 20}}));
}

TEST(Codec, WhatExceedsTheRangeIsFinishedInLaterFrames) {
  State state = bodies_at_rest(1);
  State target = state;
  target.p(0)[0] = -3000;
  const auto codec = codec_of("entropy", 1);
  encode(*codec, state, target);
  EXPECT_EQ(state.p(0)[0], -1270);
  encode(*codec, state, target);
  EXPECT_EQ(state.p(0)[0], -2540);
  encode(*codec, state, target);
  EXPECT_EQ(state.p(0)[0], -3000);
  EXPECT_TRUE(encode(*codec, state, target).bytes.empty());
}

TEST(Codec, AResidualThatRoundsToNothingIsNotSent) {
  State state = bodies_at_rest(1);
  State target = state;
  target.p(0)[0] = 101;
  const auto codec = codec_of("quantized", 1);
  std::vector<std::byte> memory(codec->bound());
  ByteWriter out(memory);
  const CodecParameters parameters{100, 300, 300};
  const CodecFrame frame{state, state.alive(), {}, parameters};
  EXPECT_TRUE(codec->encode(frame, target, kNoBudget, out, nullptr).slots.empty());
  EXPECT_EQ(out.size(), 0U);
}

TEST(Codec, EmptyBlocksSendNoSection) {
  State state = bodies_at_rest(3 * kBlockSlots);
  State target = state;
  target.p(0)[kBlockSlots + 5] = 1000;
  const Encoded encoded = encode(*codec_of("quantized", 3 * kBlockSlots), state, target);
  EXPECT_EQ(encoded.bytes.size(), 4 + 4 + 6U);
  EXPECT_EQ(encoded.corrected, std::vector<Slot>{kBlockSlots + 5});
}

TEST(Codec, ABudgetTakesTheLargestErrorsFirst) {
  State state = bodies_at_rest(1000);
  State target = state;
  for (Slot slot = 0; slot < 10; ++slot)
    target.p(0)[slot * 50] = 200 + 10 * static_cast<std::int32_t>(slot % 5);
  // Errors: 200, 210, ... 240, 200, ... Room for three bodies: slots 200 and 450 (240), then the lower of the
  // 230s.
  const Encoded encoded = encode(*codec_of("quantized", 1000), state, target, 4 + 2 + 3 * 8);
  EXPECT_EQ(encoded.corrected, (std::vector<Slot>{150, 200, 450}));
  EXPECT_EQ(encoded.bytes.size(), 4 + 2 + 3 * 8U);
}

TEST(Codec, ABudgetBelowOneBodySendsNothing) {
  State state = bodies_at_rest(1000);
  State target = state;
  target.p(0)[7] = 1000;
  for (std::size_t budget = 0; budget < 4 + 4 + 6; ++budget) {
    EXPECT_TRUE(encode(*codec_of("quantized", 1000), state, target, budget).bytes.empty()) << budget;
  }
  EXPECT_EQ(encode(*codec_of("quantized", 1000), state, target, 14).bytes.size(), 14U);
}

TEST(Codec, LimitedHoldsThePaperBudgetAndUsesNearlyAllOfIt) {
  State state = bodies_at_rest(10000);
  synthetic::Random random(3);
  State target = synthetic::random_target(random, state, 1);
  const auto size = encode(*codec_of("limited", 10000), state, target, kPaperBudgetBytes).bytes.size();
  EXPECT_LE(size, kPaperBudgetBytes);
  EXPECT_GT(size, kPaperBudgetBytes - 20);
}

TEST(Codec, AValueBeyondTheLatticeIsRefused) {
  const auto codec = codec_of("selective", 1);
  std::vector<std::byte> memory(25);
  ByteWriter out(memory);
  out.put(std::uint8_t{2});
  out.put(kPositionLimit + 1);
  for (int i = 0; i < 5; ++i) out.put(std::int32_t{0});
  const State state = bodies_at_rest(1);
  const Section section{0, memory};
  EXPECT_FALSE(codec->decode({state, state.alive(), {}, kParameters}, std::span(&section, 1)));
}

TEST(Codec, ThePaperCodecsKeepNoCoderState) {
  const auto codec = codec_of("entropy", 4);
  EXPECT_TRUE(codec->columns().empty());
  NumberDecoder nothing({});
  EXPECT_TRUE(codec->load({}, nothing));
  const std::vector<std::byte> bytes(9, std::byte{1});
  NumberDecoder something(bytes);
  EXPECT_FALSE(codec->load({}, something));
}

}  // namespace
}  // namespace tandem
