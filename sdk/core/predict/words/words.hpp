#pragma once
// Vectors of 16-bit words, and what is done in each word: one at a time, eight on any processor, sixteen with
// AVX2. Each processor's instructions for sums and products of words stand here alone; a processor that is
// not named does the same lane by lane. Everything here is inlined always: see lanes.hpp.

#include "sdk/core/predict/words/lanes.hpp"

namespace tandem {

using OneWordLane = Single<std::int16_t>;
#ifdef __AVX2__
using SixteenWords = std::int16_t __attribute__((vector_size(32)));
using SixteenHalves = std::uint16_t __attribute__((vector_size(32)));  ///< differences of these wrap
#endif

/// How many words, the lanes of 32 bits that are as wide, and the words without a sign.
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
  using Halves = EightHalves;
  static constexpr std::size_t kCount = 8;
};
#ifdef __AVX2__
template <>
struct WordLanes<SixteenWords> {
  using Wide = Eight;
  using Halves = SixteenHalves;
  static constexpr std::size_t kCount = 16;
};
#endif

TANDEM_INLINE EightWords words(Four x) { return reinterpret_cast<EightWords>(x); }
TANDEM_INLINE Four lanes(EightWords x) { return reinterpret_cast<Four>(x); }

// add_sat16 and sub_sat16 give the sum and the difference, or what is nearest to it in 16 bits.
//
// mul_q15 gives (a * b + 2^14) >> 15, the rounded product of numbers in 2^-15. Not both words may be -2^15:
// there some processors answer 2^15 - 1, and others -2^15.
//
// dot16 gives, in each lane, the product of the low words plus that of the high words. Not all four may be
// -2^15.
TANDEM_INLINE std::int32_t nearest_word(std::int32_t x) {
  return x > INT16_MAX ? INT16_MAX : x < INT16_MIN ? INT16_MIN : x;
}
TANDEM_INLINE OneWordLane add_sat16(OneWordLane a, OneWordLane b) { return nearest_word(a.x + b.x); }
TANDEM_INLINE OneWordLane sub_sat16(OneWordLane a, OneWordLane b) { return nearest_word(a.x - b.x); }
TANDEM_INLINE OneWordLane mul_q15(OneWordLane a, OneWordLane b) {
  return nearest_word((a.x * b.x + (1 << 14)) >> 15);
}
TANDEM_INLINE OneWordLane smaller(OneWordLane a, OneWordLane b) { return a < b ? a : b; }
TANDEM_INLINE OneWordLane larger(OneWordLane a, OneWordLane b) { return a > b ? a : b; }

#if defined(__SSE2__)
TANDEM_INLINE __m128i m128i(EightWords x) { return reinterpret_cast<__m128i>(x); }
TANDEM_INLINE EightWords words(__m128i x) { return reinterpret_cast<EightWords>(x); }
TANDEM_INLINE EightWords add_sat16(EightWords a, EightWords b) {
  return words(_mm_adds_epi16(m128i(a), m128i(b)));
}
TANDEM_INLINE EightWords sub_sat16(EightWords a, EightWords b) {
  return words(_mm_subs_epi16(m128i(a), m128i(b)));
}
TANDEM_INLINE EightWords mul_q15(EightWords a, EightWords b) {
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
TANDEM_INLINE EightWords add_sat16(EightWords a, EightWords b) { return words(vqaddq_s16(neon(a), neon(b))); }
TANDEM_INLINE EightWords sub_sat16(EightWords a, EightWords b) { return words(vqsubq_s16(neon(a), neon(b))); }
TANDEM_INLINE EightWords mul_q15(EightWords a, EightWords b) {
  return words(vqrdmulhq_s16(neon(a), neon(b)));
}
TANDEM_INLINE EightWords smaller(EightWords a, EightWords b) { return words(vminq_s16(neon(a), neon(b))); }
TANDEM_INLINE EightWords larger(EightWords a, EightWords b) { return words(vmaxq_s16(neon(a), neon(b))); }
#elif defined(__wasm_simd128__)
TANDEM_INLINE v128_t v128(EightWords x) { return reinterpret_cast<v128_t>(x); }
TANDEM_INLINE EightWords add_sat16(EightWords a, EightWords b) {
  return words(wasm_i16x8_add_sat(v128(a), v128(b)));
}
TANDEM_INLINE EightWords sub_sat16(EightWords a, EightWords b) {
  return words(wasm_i16x8_sub_sat(v128(a), v128(b)));
}
TANDEM_INLINE EightWords mul_q15(EightWords a, EightWords b) {
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
TANDEM_INLINE EightWords add_sat16(EightWords a, EightWords b) {
  return lane_by_lane(a, b, [](OneWordLane x, OneWordLane y) { return add_sat16(x, y); });
}
TANDEM_INLINE EightWords sub_sat16(EightWords a, EightWords b) {
  return lane_by_lane(a, b, [](OneWordLane x, OneWordLane y) { return sub_sat16(x, y); });
}
TANDEM_INLINE EightWords mul_q15(EightWords a, EightWords b) {
  return lane_by_lane(a, b, [](OneWordLane x, OneWordLane y) { return mul_q15(x, y); });
}
TANDEM_INLINE EightWords smaller(EightWords a, EightWords b) { return a < b ? a : b; }
TANDEM_INLINE EightWords larger(EightWords a, EightWords b) { return a > b ? a : b; }
#endif
TANDEM_INLINE Four dot16(EightWords a, EightWords b) {
#if defined(__SSE2__)
  return reinterpret_cast<Four>(_mm_madd_epi16(m128i(a), m128i(b)));
#elif defined(__aarch64__)
  return reinterpret_cast<Four>(
      vpaddq_s32(vmull_s16(vget_low_s16(neon(a)), vget_low_s16(neon(b))), vmull_high_s16(neon(a), neon(b))));
#elif defined(__wasm_simd128__)
  return reinterpret_cast<Four>(wasm_i32x4_dot_i16x8(v128(a), v128(b)));
#else
  const Four low = ((lanes(a) << 16) >> 16) * ((lanes(b) << 16) >> 16);
  const Four high = (lanes(a) >> 16) * (lanes(b) >> 16);
  return low + high;
#endif
}
TANDEM_INLINE bool any(EightWords x) { return any(lanes(x)); }
/// Those of `yes` where `where` has all bits set, those of `no` where none.
template <class W>
TANDEM_INLINE W chosen(W where, W yes, W no) {
  return no ^ (where & (yes ^ no));
}

#ifdef __AVX2__
TANDEM_INLINE __m256i m256i(SixteenWords x) { return reinterpret_cast<__m256i>(x); }
TANDEM_INLINE SixteenWords words(__m256i x) { return reinterpret_cast<SixteenWords>(x); }
TANDEM_INLINE SixteenWords words(Eight x) { return reinterpret_cast<SixteenWords>(x); }
TANDEM_INLINE Eight lanes(SixteenWords x) { return reinterpret_cast<Eight>(x); }
TANDEM_INLINE SixteenWords add_sat16(SixteenWords a, SixteenWords b) {
  return words(_mm256_adds_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords sub_sat16(SixteenWords a, SixteenWords b) {
  return words(_mm256_subs_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords mul_q15(SixteenWords a, SixteenWords b) {
  return words(_mm256_mulhrs_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE Eight dot16(SixteenWords a, SixteenWords b) {
  return reinterpret_cast<Eight>(_mm256_madd_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords smaller(SixteenWords a, SixteenWords b) {
  return words(_mm256_min_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE SixteenWords larger(SixteenWords a, SixteenWords b) {
  return words(_mm256_max_epi16(m256i(a), m256i(b)));
}
TANDEM_INLINE bool any(SixteenWords x) { return any(lanes(x)); }
TANDEM_INLINE SixteenWords chosen(SixteenWords where, SixteenWords yes, SixteenWords no) {
  return words(_mm256_blendv_epi8(m256i(no), m256i(yes), m256i(where)));
}
#endif

}  // namespace tandem
