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
TANDEM_INLINE std::int32_t high_negated(std::int32_t x) { return words_of(x, -high_word(x)); }

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

TANDEM_INLINE bool any(std::int32_t x) { return x != 0; }

/// Floats as wide as V, for quotients alone.
template <class V>
struct FloatsOf;
template <>
struct FloatsOf<Four> {
  using Type = float __attribute__((vector_size(16)));
};
#ifdef __AVX2__
template <>
struct FloatsOf<Eight> {
  using Type = float __attribute__((vector_size(32)));
};
#endif

/// In each lane 2^bits / x, rounded down, for 0 < x < 2^24 and a quotient below 2^22. A quotient of floats
/// may be one off, however they are rounded: the rest of the division says so.
template <class V>
TANDEM_INLINE V inverse_of(V x, int bits) {
  using Floats = typename FloatsOf<V>::Type;
  const Floats whole = __builtin_convertvector(constant<V>(1 << bits), Floats);
  V q = __builtin_convertvector(whole / __builtin_convertvector(x, Floats), V);
  const V rest = constant<V>(1 << bits) - q * x;
  q -= rest >= x;
  q += rest < 0;
  return q;
}

/// In each lane (x * 2^15) / y, rounded down, for 0 <= x <= y < 2^15 and y > 0.
template <class V>
TANDEM_INLINE V fractions(V x, V y) {
  using Floats = typename FloatsOf<V>::Type;
  const V whole = x << 15;
  V q =
      __builtin_convertvector(__builtin_convertvector(whole, Floats) / __builtin_convertvector(y, Floats), V);
  const V rest = whole - q * y;
  q -= rest >= y;
  q += rest < 0;
  return q;
}
/// The same of words, and at most 2^15 - 1.
template <class V>
TANDEM_INLINE V word_fractions(V x, V y) {
  const V most = constant<V>(INT16_MAX);
  return words_of(at_most(fractions(low_word(x), low_word(y)), most),
                  at_most(fractions(high_word(x), high_word(y)), most));
}
TANDEM_INLINE std::int32_t inverse_of(std::int32_t x, int bits) { return (1 << bits) / x; }

}  // namespace tandem
