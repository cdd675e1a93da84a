#pragma once
// Pairs of 16-bit words in the 32-bit lanes of a vector, for the passes of `rigid`. Everything here is
// inlined always: see ../contact/lanes.hpp. Intel and WebAssembly have instructions for it; elsewhere the
// same is made of 32-bit operations.

#include "sdk/core/predict/contact/lanes.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

// In WebAssembly, where nothing is made for AVX2, the larger parts are called, because modules have to be
// small.
#ifdef __wasm__
#define TANDEM_LARGE [[gnu::noinline]]
#else
#define TANDEM_LARGE TANDEM_INLINE
#endif
#if defined(__wasm__) && !defined(__wasm_simd128__)
#define TANDEM_PART [[gnu::noinline]]
#else
#define TANDEM_PART TANDEM_INLINE
#endif

namespace tandem {

template <class V>
TANDEM_INLINE V low_word(V x) {
  return (x << 16) >> 16;
}
template <class V>
TANDEM_INLINE V high_word(V x) {
  return x >> 16;
}
template <class V>
TANDEM_INLINE V words_of(V low, V high) {
  return (low & 0xFFFF) | (high << 16);
}

/// The low word in both.
template <class V>
TANDEM_INLINE V twice_the_word(V x) {
  return words_of(x, x);
}
#ifdef __AVX2__
TANDEM_INLINE Eight twice_the_word(Eight x) {
  constexpr std::int32_t kFirst = 0x01000100, kEach = 0x04040404;
  const __m256i bytes = _mm256_setr_epi32(kFirst, kFirst + kEach, kFirst + 2 * kEach, kFirst + 3 * kEach,
                                          kFirst, kFirst + kEach, kFirst + 2 * kEach, kFirst + 3 * kEach);
  return reinterpret_cast<Eight>(_mm256_shuffle_epi8(reinterpret_cast<__m256i>(x), bytes));
}
#endif

/// In each lane the sum of the products of low words and of high words. No lane of b may hold -2^15 twice.
template <class V>
TANDEM_INLINE V products(V a, V b) {
  return low_word(a) * low_word(b) + high_word(a) * high_word(b);
}
template <class V>
TANDEM_INLINE V word_range(V x) {
  return at_least(at_most(x, constant<V>(INT16_MAX)), constant<V>(INT16_MIN));
}
/// In each word the sum, or the difference, within 16 bits.
template <class V>
TANDEM_INLINE V word_sums(V a, V b) {
  return words_of(word_range(low_word(a) + low_word(b)), word_range(high_word(a) + high_word(b)));
}
template <class V>
TANDEM_INLINE V word_differences(V a, V b) {
  return words_of(word_range(low_word(a) - low_word(b)), word_range(high_word(a) - high_word(b)));
}
/// In each word (a * b + 2^14) >> 15. No word of b may be -2^15.
template <class V>
TANDEM_INLINE V word_parts(V a, V b) {
  return words_of((low_word(a) * low_word(b) + (1 << 14)) >> 15,
                  (high_word(a) * high_word(b) + (1 << 14)) >> 15);
}

/// In each word the difference, which wraps.
TANDEM_INLINE Four wrapped_differences(Four a, Four b) {
  return reinterpret_cast<Four>(reinterpret_cast<EightHalves>(a) - reinterpret_cast<EightHalves>(b));
}
#ifdef __AVX2__
TANDEM_INLINE Eight wrapped_differences(Eight a, Eight b) {
  return reinterpret_cast<Eight>(
      _mm256_sub_epi16(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}
#endif
/// Negates the high words, none of which is -2^15.
template <class V>
TANDEM_INLINE V high_negated(V x) {
  constexpr std::int32_t kHigh = -(1 << 16);
  return wrapped_differences(x ^ kHigh, V{} + kHigh);
}
#ifdef __AVX2__
TANDEM_INLINE Eight high_negated(Eight x) {
  constexpr std::int32_t kSigns = 1 - (1 << 16);
  return reinterpret_cast<Eight>(_mm256_sign_epi16(reinterpret_cast<__m256i>(x), _mm256_set1_epi32(kSigns)));
}
#endif
TANDEM_INLINE OneLane high_negated(OneLane x) { return words_of(x, -high_word(x)); }

#if defined(__SSE2__)
TANDEM_INLINE __m128i wide(Four x) { return reinterpret_cast<__m128i>(x); }
TANDEM_INLINE Four lanes(__m128i x) { return reinterpret_cast<Four>(x); }
TANDEM_INLINE Four products(Four a, Four b) { return lanes(_mm_madd_epi16(wide(a), wide(b))); }
TANDEM_INLINE Four word_sums(Four a, Four b) { return lanes(_mm_adds_epi16(wide(a), wide(b))); }
TANDEM_INLINE Four word_differences(Four a, Four b) { return lanes(_mm_subs_epi16(wide(a), wide(b))); }
#ifdef __AVX2__
TANDEM_INLINE Four word_parts(Four a, Four b) { return lanes(_mm_mulhrs_epi16(wide(a), wide(b))); }
#else
TANDEM_INLINE Four word_parts(Four a, Four b) {
  const __m128i high = _mm_mulhi_epi16(wide(a), wide(b));
  const __m128i low = _mm_srli_epi16(_mm_mullo_epi16(wide(a), wide(b)), 14);
  const __m128i one = _mm_set1_epi16(1);
  return lanes(_mm_add_epi16(_mm_slli_epi16(high, 1), _mm_srli_epi16(_mm_add_epi16(low, one), 1)));
}
#endif
#elif defined(__wasm_simd128__)
TANDEM_INLINE v128_t wide(Four x) { return reinterpret_cast<v128_t>(x); }
TANDEM_INLINE Four lanes(v128_t x) { return reinterpret_cast<Four>(x); }
TANDEM_INLINE Four products(Four a, Four b) { return lanes(wasm_i32x4_dot_i16x8(wide(a), wide(b))); }
TANDEM_INLINE Four word_sums(Four a, Four b) { return lanes(wasm_i16x8_add_sat(wide(a), wide(b))); }
TANDEM_INLINE Four word_differences(Four a, Four b) { return lanes(wasm_i16x8_sub_sat(wide(a), wide(b))); }
TANDEM_INLINE Four word_parts(Four a, Four b) { return lanes(wasm_i16x8_q15mulr_sat(wide(a), wide(b))); }
#endif

#ifdef __AVX2__
TANDEM_INLINE __m256i wide(Eight x) { return reinterpret_cast<__m256i>(x); }
TANDEM_INLINE Eight lanes(__m256i x) { return reinterpret_cast<Eight>(x); }
TANDEM_INLINE Eight products(Eight a, Eight b) { return lanes(_mm256_madd_epi16(wide(a), wide(b))); }
TANDEM_INLINE Eight word_sums(Eight a, Eight b) { return lanes(_mm256_adds_epi16(wide(a), wide(b))); }
TANDEM_INLINE Eight word_differences(Eight a, Eight b) { return lanes(_mm256_subs_epi16(wide(a), wide(b))); }
TANDEM_INLINE Eight word_parts(Eight a, Eight b) { return lanes(_mm256_mulhrs_epi16(wide(a), wide(b))); }
#endif

/// In each lane 2^bits / x, rounded down, for x > 0.
template <class V>
TANDEM_INLINE V inverse_of(V x, int bits) {
  V q{};
  for (std::size_t lane = 0; lane < kLanes<V>; ++lane) q[lane] = (1 << bits) / x[lane];
  return q;
}
TANDEM_INLINE OneLane inverse_of(OneLane x, int bits) { return (1 << bits) / x.x; }

/// In each lane the root of 0 <= x < 2^30, rounded down.
template <class V>
TANDEM_INLINE V root_of(V x) {
  V root{};
  for (std::int32_t bit = 1 << 28; bit != 0; bit >>= 2) {
    const V with = root + bit;
    const auto fits = x >= with;
    x -= fits ? with : V{};
    root = (root >> 1) + (fits ? V{} + bit : V{});
  }
  return root;
}

}  // namespace tandem
