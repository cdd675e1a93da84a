#include "sdk/core/codec/paper/huffman.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

SymbolCounts skewed_counts(std::uint64_t base) {
  SymbolCounts counts{};
  std::uint64_t count = 1;
  for (std::uint64_t& each : counts) {
    each = count;
    count = std::min<std::uint64_t>(count * base, std::uint64_t{1} << 40U);
  }
  return counts;
}

TEST(CodeLengths, OfEqualCountsAreEightBits) {
  const CodeLengths lengths = build_code_lengths(SymbolCounts{});
  EXPECT_TRUE(std::all_of(lengths.begin(), lengths.end(), [](std::uint8_t l) { return l == 8; }));
}

TEST(CodeLengths, AreCompleteAndLimitedForAnySkew) {
  for (std::uint64_t base = 1; base < 10; ++base) {
    const CodeLengths lengths = build_code_lengths(skewed_counts(base));
    EXPECT_TRUE(is_complete_code(lengths)) << "base " << base;
  }
}

TEST(CodeLengths, ASymbolThatNeverOccurredStillHasACode) {
  SymbolCounts counts{};
  counts[0] = std::uint64_t{1} << 50U;
  const CodeLengths lengths = build_code_lengths(counts);
  EXPECT_EQ(lengths[0], 1);
  EXPECT_TRUE(is_complete_code(lengths));
}

TEST(CodeLengths, FollowTheCounts) {
  // Half the counts at symbol 0, a quarter at 1, ...: a code of 1, 2, 3, ... bits is ideal.
  SymbolCounts counts{};
  for (std::size_t s = 0; s < 12; ++s) counts[s] = std::uint64_t{1} << (40U - s);
  const CodeLengths lengths = build_code_lengths(counts);
  // The rarest give way to the 244 symbols that never occurred, whose codes may not be longer than the limit.
  for (std::size_t s = 0; s < 9; ++s) EXPECT_EQ(lengths[s], s + 1);
}

TEST(CodeLengths, AnIncompleteOverfullOrTooLongCodeIsNone) {
  CodeLengths lengths{};
  lengths.fill(8);
  EXPECT_TRUE(is_complete_code(lengths));
  lengths[3] = 9;
  EXPECT_FALSE(is_complete_code(lengths));
  lengths[3] = 7;
  EXPECT_FALSE(is_complete_code(lengths));
  lengths[3] = 0;
  EXPECT_FALSE(is_complete_code(lengths));
  lengths[3] = kMaxCodeLength + 1;
  EXPECT_FALSE(is_complete_code(lengths));
}

TEST(HuffmanCode, DecodesWhatItWroteForEverySymbolAndLength) {
  for (const std::uint64_t base : {1U, 2U, 3U}) {
    const HuffmanCode code(build_code_lengths(skewed_counts(base)));
    synthetic::Random random(base);
    std::vector<std::uint8_t> symbols;
    for (unsigned s = 0; s < kSymbols; ++s) symbols.push_back(static_cast<std::uint8_t>(s));
    for (int i = 0; i < 5000; ++i) symbols.push_back(static_cast<std::uint8_t>(random.below(kSymbols)));
    std::size_t bits = 0;
    for (const std::uint8_t symbol : symbols) bits += code.length(symbol);
    std::vector<std::byte> bytes((bits + 7) / 8);
    BitWriter out(bytes.data());
    for (const std::uint8_t symbol : symbols) code.put(out, symbol);
    out.finish();
    BitReader in(bytes);
    for (const std::uint8_t symbol : symbols) {
      in.refill();
      const auto read = code.peek(in.window());
      ASSERT_EQ(read.value, symbol);
      ASSERT_EQ(read.length, code.length(symbol));
      ASSERT_LE(read.length, in.held());
      in.skip(read.length);
    }
    EXPECT_TRUE(in.at_end());
  }
}

TEST(HuffmanCode, CodesCountUpBySymbolWithinALength) {
  CodeLengths lengths{};
  lengths.fill(9);
  lengths[5] = 1;    // 0
  lengths[7] = 9;    // 9-bit codes fill the upper half: 256 of them would, 255 are there
  lengths[200] = 8;  // 10000000: shorter codes come first
  const HuffmanCode code(lengths);
  ASSERT_TRUE(is_complete_code(lengths));
  const auto bits_of = [&code](std::uint8_t symbol) {
    std::array<std::byte, 4> bytes{};
    BitWriter out(bytes.data());
    code.put(out, symbol);
    out.finish();
    return (std::to_integer<unsigned>(bytes[0]) << 8U) | std::to_integer<unsigned>(bytes[1]);
  };
  EXPECT_EQ(bits_of(5), 0U);
  EXPECT_EQ(bits_of(200), 0b1000'0000'0000'0000U);
  EXPECT_EQ(bits_of(0), 0b1000'0001'0000'0000U);
  EXPECT_EQ(bits_of(1), 0b1000'0001'1000'0000U);
}

TEST(BitReader, PaddingMustBeShortAndZero) {
  const std::array<std::byte, 2> bytes{std::byte{0b1010'0000}, std::byte{0}};
  BitReader one{std::span(bytes).first(1)};
  one.refill();
  EXPECT_EQ(one.take(3), 0b101U);
  EXPECT_TRUE(one.at_end());
  BitReader two(bytes);
  two.refill();
  EXPECT_EQ(two.take(3), 0b101U);
  EXPECT_FALSE(two.at_end());
  BitReader dirty{std::span(bytes).first(1)};
  dirty.refill();
  EXPECT_EQ(dirty.take(2), 0b10U);
  EXPECT_FALSE(dirty.at_end());
}

}  // namespace
}  // namespace tandem
