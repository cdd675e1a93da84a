#pragma once
// Vectors of integers for the passes of `hard` and `rigid`: four at a time on any processor, eight with AVX2,
// one where there are no vectors.
// Everything here is inlined always. Otherwise the linker might keep a copy made for AVX2 for all callers.

#include <cstdint>

#include "sdk/core/predict/words/four.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#define TANDEM_INLINE [[gnu::always_inline]] inline

namespace tandem {

/// Whether something is true of a single lane. It is no number, because truth is -1 in a lane of a vector and
/// 1 in an integer: code for both writes `x < y ? a : b`, and what computes with a comparison does not
/// compile.
struct LaneTruth {
  bool is;
  TANDEM_INLINE explicit operator bool() const { return is; }
};

/// A vector of one lane, for machines without vectors. T: std::int16_t, std::int32_t.
template <class T>
struct Single {
  T x;

  Single() = default;
  TANDEM_INLINE Single(std::int32_t value) : x(static_cast<T>(value)) {}  // NOLINT: as scalars of vectors

  TANDEM_INLINE friend Single operator+(Single a, Single b) { return a.x + b.x; }
  TANDEM_INLINE friend Single operator-(Single a, Single b) { return a.x - b.x; }
  TANDEM_INLINE friend Single operator*(Single a, Single b) { return a.x * b.x; }
  TANDEM_INLINE friend Single operator<<(Single a, int bits) { return a.x << bits; }
  TANDEM_INLINE friend Single operator>>(Single a, int bits) { return a.x >> bits; }
  TANDEM_INLINE friend Single operator&(Single a, Single b) { return a.x & b.x; }
  TANDEM_INLINE friend Single operator|(Single a, Single b) { return a.x | b.x; }
  TANDEM_INLINE friend Single operator^(Single a, Single b) { return a.x ^ b.x; }
  TANDEM_INLINE friend Single operator-(Single a) { return -a.x; }
  TANDEM_INLINE Single& operator+=(Single b) { return *this = *this + b; }
  TANDEM_INLINE Single& operator-=(Single b) { return *this = *this - b; }
  TANDEM_INLINE friend LaneTruth operator<(Single a, Single b) { return {a.x < b.x}; }
  TANDEM_INLINE friend LaneTruth operator>(Single a, Single b) { return {a.x > b.x}; }
  TANDEM_INLINE friend LaneTruth operator>=(Single a, Single b) { return {a.x >= b.x}; }
  TANDEM_INLINE friend LaneTruth operator==(Single a, Single b) { return {a.x == b.x}; }
  TANDEM_INLINE friend LaneTruth operator!=(Single a, Single b) { return {a.x != b.x}; }
};
using OneLane = Single<std::int32_t>;

#ifdef __AVX2__
using Eight = std::int32_t __attribute__((vector_size(32)));
#endif

template <class V>
inline constexpr std::size_t kLanes = sizeof(V) / sizeof(std::int32_t);

/// Words as wide as the lanes of V are many.
template <class V>
struct WordsOf;
template <>
struct WordsOf<Four> {
  using Type = FourWords;
};
#ifdef __AVX2__
template <>
struct WordsOf<Eight> {
  using Type = EightWords;
};
#endif

template <class V>
TANDEM_INLINE V read(const void* from) {
  V x;
  __builtin_memcpy(&x, from, sizeof x);
  return x;
}
template <class V>
TANDEM_INLINE void write(void* to, V x) {
  __builtin_memcpy(to, &x, sizeof x);
}

template <class V>
TANDEM_INLINE V read_words(const std::int16_t* from) {
  return __builtin_convertvector(read<typename WordsOf<V>::Type>(from), V);
}
template <class V>
TANDEM_INLINE void write_words(std::int16_t* to, V x) {
  using Words = typename WordsOf<V>::Type;
  write(to, __builtin_convertvector(x, Words));
}

template <class V>
TANDEM_INLINE V at_most(V x, V limit) {
  return x > limit ? limit : x;
}
template <class V>
TANDEM_INLINE V at_least(V x, V limit) {
  return x < limit ? limit : x;
}
template <class V>
TANDEM_INLINE V within(V x, V limit) {
  return at_least(at_most(x, limit), -limit);
}
template <class V>
TANDEM_INLINE V constant(std::int32_t x) {
  return V{} + x;
}

/// True if a bit is set in any lane.
template <class T>
TANDEM_INLINE bool any(Single<T> lane) {
  return lane.x != 0;
}
TANDEM_INLINE bool any(Four x) {
  using Two = std::int64_t __attribute__((vector_size(16)));
  const Two two = reinterpret_cast<Two>(x);
  return (two[0] | two[1]) != 0;
}
#ifdef __AVX2__
TANDEM_INLINE Four low_half(Eight x) { return __builtin_shufflevector(x, x, 0, 1, 2, 3); }
TANDEM_INLINE Four high_half(Eight x) { return __builtin_shufflevector(x, x, 4, 5, 6, 7); }
TANDEM_INLINE bool any(Eight x) {
  const __m256i bits = reinterpret_cast<__m256i>(x);
  return _mm256_testz_si256(bits, bits) == 0;
}
#endif

/// In bit k whether lane k is below 0.
TANDEM_INLINE std::uint32_t signs_of(Four x) {
#if defined(__SSE2__)
  return static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(x)));
#elif defined(__wasm_simd128__)
  return wasm_i32x4_bitmask(reinterpret_cast<v128_t>(x));
#else
  std::uint32_t signs = 0;
  for (std::size_t k = 0; k < 4; ++k) signs |= (bits_of(x[k]) >> 31U) << k;
  return signs;
#endif
}
#ifdef __AVX2__
TANDEM_INLINE std::uint32_t signs_of(Eight x) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(x)));
}
#endif
/// In bit k whether lane k has all bits set; the others have none.
TANDEM_INLINE std::uint32_t truths_of(Four mask) {
#if defined(__SSE2__) || defined(__wasm_simd128__)
  return signs_of(mask);
#elif defined(__aarch64__)
  return vaddvq_u32(reinterpret_cast<uint32x4_t>(bits_of(mask) & FourBits{1, 2, 4, 8}));
#else
  const FourBits bits = bits_of(mask);
  return (bits[0] & 1U) | (bits[1] & 2U) | (bits[2] & 4U) | (bits[3] & 8U);
#endif
}

/// Rows of four integers: of Eight, those at `one` and at `other`.
TANDEM_INLINE void read_rows(Four& x, const char* one, const char* /*other*/) { x = read<Four>(one); }
TANDEM_INLINE void write_rows(char* one, char* /*other*/, Four x) { write(one, x); }
#ifdef __AVX2__
TANDEM_INLINE void read_rows(Eight& x, const char* one, const char* other) {
  x = __builtin_shufflevector(read<Four>(one), read<Four>(other), 0, 1, 2, 3, 4, 5, 6, 7);
}
TANDEM_INLINE void write_rows(char* one, char* other, Eight x) {
  write(one, low_half(x));
  write(other, high_half(x));
}
#endif

/// Four rows of V. Of Eight, row k has those of k and of k + 4.
template <class V>
struct Rows {
  V of0, of1, of2, of3;
};

/// Transposes each four rows of four: then lane k of row i is what was lane i of row k.
TANDEM_INLINE Rows<Four> transposed(const Rows<Four>& x) {
  const Four ab_low = __builtin_shufflevector(x.of0, x.of1, 0, 4, 1, 5);
  const Four ab_high = __builtin_shufflevector(x.of0, x.of1, 2, 6, 3, 7);
  const Four cd_low = __builtin_shufflevector(x.of2, x.of3, 0, 4, 1, 5);
  const Four cd_high = __builtin_shufflevector(x.of2, x.of3, 2, 6, 3, 7);
  return {__builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5),
          __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7),
          __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5),
          __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7)};
}
#ifdef __AVX2__
TANDEM_INLINE Rows<Eight> transposed(const Rows<Eight>& x) {
  const Eight ab_low = __builtin_shufflevector(x.of0, x.of1, 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight ab_high = __builtin_shufflevector(x.of0, x.of1, 2, 10, 3, 11, 6, 14, 7, 15);
  const Eight cd_low = __builtin_shufflevector(x.of2, x.of3, 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight cd_high = __builtin_shufflevector(x.of2, x.of3, 2, 10, 3, 11, 6, 14, 7, 15);
  return {__builtin_shufflevector(ab_low, cd_low, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(ab_low, cd_low, 2, 3, 10, 11, 6, 7, 14, 15),
          __builtin_shufflevector(ab_high, cd_high, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(ab_high, cd_high, 2, 3, 10, 11, 6, 7, 14, 15)};
}
#endif

/// In each lane 2^24 / x, rounded down, for x of 2^12 to 2^13: a line through 1 / x, two steps of
/// Newton, and a correction by the remainder.
template <class V>
TANDEM_INLINE V inverse_near_one(V x) {
  constexpr std::int32_t kWhole = 1 << 24;
  V q = 5783 - ((x * 1928) >> 12);  // 2^24 / x is 4096 at 2^12 and 2048 at 2^13
  q += (q * ((kWhole - x * q) >> 6)) >> 18;
  q += (q * ((kWhole - x * q) >> 6)) >> 18;
  const V left = kWhole - x * q;
  return left < 0 ? q - 1 : left >= x ? q + 1 : q;
}

}  // namespace tandem
