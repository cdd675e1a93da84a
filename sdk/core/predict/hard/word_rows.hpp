#pragma once
// Rows of three 16-bit words and a 0, of 8 bytes, for the passes of `hard`: from memory, to one body in each
// word, and back. Everything here is inlined always: see ../words/lanes.hpp.

#include "sdk/core/predict/words/words.hpp"

namespace tandem {

/// Takes words, or pairs of words, by turns from the lower, or upper, halves of each 16 bytes. By
/// instructions: with the shuffles of ../rigid/box_words.hpp GCC 12 makes more code here, and the other way
/// round.
TANDEM_INLINE EightWords zip_low(EightWords a, EightWords b) {
  return __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11);
}
TANDEM_INLINE EightWords zip_high(EightWords a, EightWords b) {
  return __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15);
}
TANDEM_INLINE EightWords zip_pairs_low(EightWords a, EightWords b) {
  return __builtin_shufflevector(a, b, 0, 1, 8, 9, 2, 3, 10, 11);
}
TANDEM_INLINE EightWords zip_pairs_high(EightWords a, EightWords b) {
  return __builtin_shufflevector(a, b, 4, 5, 12, 13, 6, 7, 14, 15);
}
#ifdef __AVX2__
TANDEM_INLINE SixteenWords zip_low(SixteenWords a, SixteenWords b) {
  return words(_mm256_unpacklo_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords zip_high(SixteenWords a, SixteenWords b) {
  return words(_mm256_unpackhi_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords zip_pairs_low(SixteenWords a, SixteenWords b) {
  return words(_mm256_unpacklo_epi32(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords zip_pairs_high(SixteenWords a, SixteenWords b) {
  return words(_mm256_unpackhi_epi32(m256i(a), m256i(b)));
}
#endif

/// x, y and z of one body in each lane.
template <class W>
struct WordAxes {
  W x, y, z;
};

/// Rows of as many bodies, two in each 16 bytes: 0 and 1 in the first, 2 and 3 in the second, ...; the upper
/// halves of sixteen words have those from 8 on. With one word at a time, it is the row itself.
template <class W>
struct WordRows {
  W of0, of1, of2, of3;
};
template <>
struct WordRows<OneWordLane> {
  OneWordLane x, y, z, unused;
};

using TwoRows = std::int64_t __attribute__((vector_size(16)));
TANDEM_INLINE EightWords two_rows(const char* rows, const std::uint32_t* of) {
  const TwoRows two{read<std::int64_t>(rows + of[0]), read<std::int64_t>(rows + of[1])};
  return reinterpret_cast<EightWords>(two);
}
TANDEM_INLINE void write_two_rows(char* rows, const std::uint32_t* of, EightWords x) {
  const TwoRows two = reinterpret_cast<TwoRows>(x);
  write<std::int64_t>(rows + of[0], two[0]);
  write<std::int64_t>(rows + of[1], two[1]);
}
TANDEM_INLINE void read_rows(WordRows<EightWords>& x, const char* rows, const std::uint32_t* of) {
  x = {two_rows(rows, of), two_rows(rows, of + 2), two_rows(rows, of + 4), two_rows(rows, of + 6)};
}
TANDEM_INLINE void write_rows(const WordRows<EightWords>& x, char* rows, const std::uint32_t* of) {
  write_two_rows(rows, of, x.of0);
  write_two_rows(rows, of + 2, x.of1);
  write_two_rows(rows, of + 4, x.of2);
  write_two_rows(rows, of + 6, x.of3);
}
#ifdef __AVX2__
TANDEM_INLINE SixteenWords four_rows(const char* rows, const std::uint32_t* of) {
  return words(_mm256_inserti128_si256(_mm256_castsi128_si256(m128i(two_rows(rows, of))),
                                       m128i(two_rows(rows, of + 8)), 1));
}
TANDEM_INLINE void write_four_rows(char* rows, const std::uint32_t* of, SixteenWords x) {
  write_two_rows(rows, of, words(_mm256_castsi256_si128(m256i(x))));
  write_two_rows(rows, of + 8, words(_mm256_extracti128_si256(m256i(x), 1)));
}
TANDEM_INLINE void read_rows(WordRows<SixteenWords>& x, const char* rows, const std::uint32_t* of) {
  x = {four_rows(rows, of), four_rows(rows, of + 2), four_rows(rows, of + 4), four_rows(rows, of + 6)};
}
TANDEM_INLINE void write_rows(const WordRows<SixteenWords>& x, char* rows, const std::uint32_t* of) {
  write_four_rows(rows, of, x.of0);
  write_four_rows(rows, of + 2, x.of1);
  write_four_rows(rows, of + 4, x.of2);
  write_four_rows(rows, of + 6, x.of3);
}
#endif
TANDEM_INLINE void read_rows(WordRows<OneWordLane>& x, const char* rows, const std::uint32_t* of) {
  x = read<WordRows<OneWordLane>>(rows + of[0]);
}
TANDEM_INLINE void write_rows(const WordRows<OneWordLane>& x, char* rows, const std::uint32_t* of) {
  write(rows + of[0], x);
}

/// From rows to axes and back.
template <class W>
TANDEM_INLINE WordAxes<W> axes_of(const WordRows<W>& r) {
  const W low02 = zip_low(r.of0, r.of2);    // x0 x4 y0 y4 z0 z4 ..
  const W high02 = zip_high(r.of0, r.of2);  // x1 x5 ...
  const W low13 = zip_low(r.of1, r.of3);    // x2 x6 ...
  const W high13 = zip_high(r.of1, r.of3);  // x3 x7 ...
  const W even = zip_low(low02, low13);
  const W odd = zip_low(high02, high13);
  return {zip_low(even, odd), zip_high(even, odd), zip_low(zip_high(low02, low13), zip_high(high02, high13))};
}
TANDEM_INLINE WordAxes<OneWordLane> axes_of(const WordRows<OneWordLane>& r) { return {r.x, r.y, r.z}; }
template <class W>
TANDEM_INLINE WordRows<W> rows_of(const WordAxes<W>& a) {
  const W xy_low = zip_low(a.x, a.y);
  const W xy_high = zip_high(a.x, a.y);
  const W z_low = zip_low(a.z, W{});
  const W z_high = zip_high(a.z, W{});
  return {zip_pairs_low(xy_low, z_low), zip_pairs_high(xy_low, z_low), zip_pairs_low(xy_high, z_high),
          zip_pairs_high(xy_high, z_high)};
}
TANDEM_INLINE WordRows<OneWordLane> rows_of(const WordAxes<OneWordLane>& a) { return {a.x, a.y, a.z, 0}; }

template <class W>
TANDEM_INLINE WordRows<W> add_sat16(const WordRows<W>& a, const WordRows<W>& b) {
  return {add_sat16(a.of0, b.of0), add_sat16(a.of1, b.of1), add_sat16(a.of2, b.of2), add_sat16(a.of3, b.of3)};
}
template <class W>
TANDEM_INLINE WordRows<W> sub_sat16(const WordRows<W>& a, const WordRows<W>& b) {
  return {sub_sat16(a.of0, b.of0), sub_sat16(a.of1, b.of1), sub_sat16(a.of2, b.of2), sub_sat16(a.of3, b.of3)};
}
TANDEM_INLINE WordRows<OneWordLane> add_sat16(const WordRows<OneWordLane>& a,
                                              const WordRows<OneWordLane>& b) {
  return {add_sat16(a.x, b.x), add_sat16(a.y, b.y), add_sat16(a.z, b.z), 0};
}
TANDEM_INLINE WordRows<OneWordLane> sub_sat16(const WordRows<OneWordLane>& a,
                                              const WordRows<OneWordLane>& b) {
  return {sub_sat16(a.x, b.x), sub_sat16(a.y, b.y), sub_sat16(a.z, b.z), 0};
}

/// a * b on each axis.
template <class W>
TANDEM_INLINE WordAxes<W> mul_q15(const WordAxes<W>& a, W b) {
  return {mul_q15(a.x, b), mul_q15(a.y, b), mul_q15(a.z, b)};
}

}  // namespace tandem
