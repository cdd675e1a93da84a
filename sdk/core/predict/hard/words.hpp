#pragma once
// Vectors of 16-bit words, for the passes of `hard`: eight at a time on any processor, sixteen with AVX2, or
// one where there are no vectors. Everything here is inlined always: see ../contact/lanes.hpp. Other
// processors than those named here do it lane by lane.

#include "sdk/core/predict/contact/lanes.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

namespace tandem {

#ifdef __AVX2__
using SixteenWords = std::int16_t __attribute__((vector_size(32)));
#endif

using OneWordLane = Single<std::int16_t>;

/// How many words, and the 32-bit lanes that are as wide. Rows are three words and a 0, of 8 bytes.
template <class W>
struct WordLanes;
template <>
struct WordLanes<OneWordLane> {
  using Wide = Four;
  static constexpr std::size_t kCount = 1;
};
template <>
struct WordLanes<EightWords> {
  using Wide = Four;
  static constexpr std::size_t kCount = 8;
};
#ifdef __AVX2__
template <>
struct WordLanes<SixteenWords> {
  using Wide = Eight;
  static constexpr std::size_t kCount = 16;
};
#endif

// As everywhere, sums and differences stay within 16 bits.
TANDEM_INLINE OneWordLane word_of(std::int32_t x) {
  return x > INT16_MAX ? INT16_MAX : x < INT16_MIN ? INT16_MIN : x;
}
TANDEM_INLINE OneWordLane sums(OneWordLane a, OneWordLane b) { return word_of(a.x + b.x); }
TANDEM_INLINE OneWordLane differences(OneWordLane a, OneWordLane b) { return word_of(a.x - b.x); }
/// (a * b + 2^14) >> 15. b is not -2^15.
TANDEM_INLINE OneWordLane parts(OneWordLane a, OneWordLane b) {
  return word_of((a.x * b.x + (1 << 14)) >> 15);
}
TANDEM_INLINE OneWordLane smaller(OneWordLane a, OneWordLane b) { return a < b ? a : b; }
TANDEM_INLINE OneWordLane larger(OneWordLane a, OneWordLane b) { return a > b ? a : b; }

#if defined(__SSE2__)
TANDEM_INLINE __m128i m128i(EightWords x) { return reinterpret_cast<__m128i>(x); }
TANDEM_INLINE EightWords words(__m128i x) { return reinterpret_cast<EightWords>(x); }
TANDEM_INLINE EightWords sums(EightWords a, EightWords b) {
  return words(_mm_adds_epi16(m128i(a), m128i(b)));
}
TANDEM_INLINE EightWords differences(EightWords a, EightWords b) {
  return words(_mm_subs_epi16(m128i(a), m128i(b)));
}
TANDEM_INLINE EightWords parts(EightWords a, EightWords b) {
#ifdef __AVX2__
  return words(_mm_mulhrs_epi16(m128i(a), m128i(b)));
#else
  const __m128i high = _mm_mulhi_epi16(m128i(a), m128i(b));
  const __m128i low = _mm_srli_epi16(_mm_mullo_epi16(m128i(a), m128i(b)), 14);
  const __m128i one = _mm_set1_epi16(1);
  return words(_mm_add_epi16(_mm_slli_epi16(high, 1), _mm_srli_epi16(_mm_add_epi16(low, one), 1)));
#endif
}
TANDEM_INLINE EightWords smaller(EightWords a, EightWords b) {
  return words(_mm_min_epi16(m128i(a), m128i(b)));
}
TANDEM_INLINE EightWords larger(EightWords a, EightWords b) {
  return words(_mm_max_epi16(m128i(a), m128i(b)));
}
#elif defined(__ARM_NEON)
TANDEM_INLINE int16x8_t neon(EightWords x) { return reinterpret_cast<int16x8_t>(x); }
TANDEM_INLINE EightWords words(int16x8_t x) { return reinterpret_cast<EightWords>(x); }
TANDEM_INLINE EightWords sums(EightWords a, EightWords b) { return words(vqaddq_s16(neon(a), neon(b))); }
TANDEM_INLINE EightWords differences(EightWords a, EightWords b) {
  return words(vqsubq_s16(neon(a), neon(b)));
}
TANDEM_INLINE EightWords parts(EightWords a, EightWords b) { return words(vqrdmulhq_s16(neon(a), neon(b))); }
TANDEM_INLINE EightWords smaller(EightWords a, EightWords b) { return words(vminq_s16(neon(a), neon(b))); }
TANDEM_INLINE EightWords larger(EightWords a, EightWords b) { return words(vmaxq_s16(neon(a), neon(b))); }
#elif defined(__wasm_simd128__)
TANDEM_INLINE v128_t v128(EightWords x) { return reinterpret_cast<v128_t>(x); }
TANDEM_INLINE EightWords words(v128_t x) { return reinterpret_cast<EightWords>(x); }
TANDEM_INLINE EightWords sums(EightWords a, EightWords b) {
  return words(wasm_i16x8_add_sat(v128(a), v128(b)));
}
TANDEM_INLINE EightWords differences(EightWords a, EightWords b) {
  return words(wasm_i16x8_sub_sat(v128(a), v128(b)));
}
TANDEM_INLINE EightWords parts(EightWords a, EightWords b) {
  return words(wasm_i16x8_q15mulr_sat(v128(a), v128(b)));
}
TANDEM_INLINE EightWords smaller(EightWords a, EightWords b) {
  return words(wasm_i16x8_min(v128(a), v128(b)));
}
TANDEM_INLINE EightWords larger(EightWords a, EightWords b) {
  return words(wasm_i16x8_max(v128(a), v128(b)));
}
#else
template <class Operation>
TANDEM_INLINE EightWords lane_by_lane(EightWords a, EightWords b, Operation operation) {
  for (std::size_t i = 0; i < 8; ++i) a[i] = operation(OneWordLane{a[i]}, OneWordLane{b[i]}).x;
  return a;
}
TANDEM_INLINE EightWords sums(EightWords a, EightWords b) {
  return lane_by_lane(a, b, [](OneWordLane x, OneWordLane y) { return sums(x, y); });
}
TANDEM_INLINE EightWords differences(EightWords a, EightWords b) {
  return lane_by_lane(a, b, [](OneWordLane x, OneWordLane y) { return differences(x, y); });
}
TANDEM_INLINE EightWords parts(EightWords a, EightWords b) {
  return lane_by_lane(a, b, [](OneWordLane x, OneWordLane y) { return parts(x, y); });
}
TANDEM_INLINE EightWords smaller(EightWords a, EightWords b) { return a < b ? a : b; }
TANDEM_INLINE EightWords larger(EightWords a, EightWords b) { return a > b ? a : b; }
#endif
TANDEM_INLINE bool any(EightWords x) { return any(reinterpret_cast<Four>(x)); }

#ifdef __AVX2__
TANDEM_INLINE __m256i m256i(SixteenWords x) { return reinterpret_cast<__m256i>(x); }
TANDEM_INLINE SixteenWords words(__m256i x) { return reinterpret_cast<SixteenWords>(x); }
TANDEM_INLINE SixteenWords sums(SixteenWords a, SixteenWords b) {
  return words(_mm256_adds_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords differences(SixteenWords a, SixteenWords b) {
  return words(_mm256_subs_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords parts(SixteenWords a, SixteenWords b) {
  return words(_mm256_mulhrs_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords smaller(SixteenWords a, SixteenWords b) {
  return words(_mm256_min_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords larger(SixteenWords a, SixteenWords b) {
  return words(_mm256_max_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE bool any(SixteenWords x) { return _mm256_testz_si256(m256i(x), m256i(x)) == 0; }
#endif

/// Takes words, or pairs of words, by turns from the lower, or upper, halves of each 16 bytes.
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
TANDEM_INLINE WordRows<W> sums(const WordRows<W>& a, const WordRows<W>& b) {
  return {sums(a.of0, b.of0), sums(a.of1, b.of1), sums(a.of2, b.of2), sums(a.of3, b.of3)};
}
template <class W>
TANDEM_INLINE WordRows<W> differences(const WordRows<W>& a, const WordRows<W>& b) {
  return {differences(a.of0, b.of0), differences(a.of1, b.of1), differences(a.of2, b.of2),
          differences(a.of3, b.of3)};
}
TANDEM_INLINE WordRows<OneWordLane> sums(const WordRows<OneWordLane>& a, const WordRows<OneWordLane>& b) {
  return {sums(a.x, b.x), sums(a.y, b.y), sums(a.z, b.z), 0};
}
TANDEM_INLINE WordRows<OneWordLane> differences(const WordRows<OneWordLane>& a,
                                                const WordRows<OneWordLane>& b) {
  return {differences(a.x, b.x), differences(a.y, b.y), differences(a.z, b.z), 0};
}

/// a * b on each axis, as parts().
template <class W>
TANDEM_INLINE WordAxes<W> parts(const WordAxes<W>& a, W b) {
  return {parts(a.x, b), parts(a.y, b), parts(a.z, b)};
}

}  // namespace tandem
