#pragma once
// Pairs of 16-bit words in the 32-bit lanes of a vector, for the passes of `rigid`. Everything here is
// inlined always: see ../words/lanes.hpp. Where a
// processor has no instructions for it, the same is made of 32-bit operations.

#include "sdk/core/predict/words/words.hpp"

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

// As of ../words/words.hpp, for the words of each lane.
template <class V>
TANDEM_INLINE V dot16(V a, V b) {
  return low_word(a) * low_word(b) + high_word(a) * high_word(b);
}
template <class V>
TANDEM_INLINE V word_range(V x) {
  return at_least(at_most(x, constant<V>(INT16_MAX)), constant<V>(INT16_MIN));
}
template <class V>
TANDEM_INLINE V add_sat16(V a, V b) {
  return words_of(word_range(low_word(a) + low_word(b)), word_range(high_word(a) + high_word(b)));
}
template <class V>
TANDEM_INLINE V sub_sat16(V a, V b) {
  return words_of(word_range(low_word(a) - low_word(b)), word_range(high_word(a) - high_word(b)));
}
template <class V>
TANDEM_INLINE V mul_q15(V a, V b) {
  return words_of((low_word(a) * low_word(b) + (1 << 14)) >> 15,
                  (high_word(a) * high_word(b) + (1 << 14)) >> 15);
}

/// In each word the difference, which wraps.
TANDEM_INLINE Four wrapped_differences(Four a, Four b) {
  return reinterpret_cast<Four>(reinterpret_cast<EightHalves>(a) - reinterpret_cast<EightHalves>(b));
}
#ifdef __AVX2__
TANDEM_INLINE Eight wrapped_differences(Eight a, Eight b) {
  return reinterpret_cast<Eight>(reinterpret_cast<SixteenHalves>(a) - reinterpret_cast<SixteenHalves>(b));
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

#if defined(__SSE2__) || defined(__wasm_simd128__)
TANDEM_INLINE Four dot16(Four a, Four b) { return dot16(words(a), words(b)); }
TANDEM_INLINE Four add_sat16(Four a, Four b) { return lanes(add_sat16(words(a), words(b))); }
TANDEM_INLINE Four sub_sat16(Four a, Four b) { return lanes(sub_sat16(words(a), words(b))); }
TANDEM_INLINE Four mul_q15(Four a, Four b) { return lanes(mul_q15(words(a), words(b))); }
#endif
#ifdef __AVX2__
TANDEM_INLINE Eight dot16(Eight a, Eight b) { return dot16(words(a), words(b)); }
TANDEM_INLINE Eight add_sat16(Eight a, Eight b) { return lanes(add_sat16(words(a), words(b))); }
TANDEM_INLINE Eight sub_sat16(Eight a, Eight b) { return lanes(sub_sat16(words(a), words(b))); }
TANDEM_INLINE Eight mul_q15(Eight a, Eight b) { return lanes(mul_q15(words(a), words(b))); }
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
