#pragma once
// Sixteen 16-bit integers at once, with the same bits everywhere. Sums wrap, comparisons give 0 or -1. In an
// unnamed namespace, because one translation unit is compiled for AVX2 and the linker must not mix them.

#include <cstddef>
#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace tandem {
namespace {

constexpr std::uint32_t kLanes = 16;

#if defined(__AVX2__)

struct Lanes {
  __m256i x;
};
struct Sums {
  __m256i x;
};
inline Sums no_sums() { return {_mm256_setzero_si256()}; }
inline Sums operator+(Sums a, Sums b) { return {_mm256_add_epi32(a.x, b.x)}; }
inline Sums product(Lanes a, Lanes b) { return {_mm256_madd_epi16(a.x, b.x)}; }
inline Lanes load(const std::int16_t* from) {
  return {_mm256_loadu_si256(reinterpret_cast<const __m256i_u*>(from))};
}
inline void store(std::int16_t* to, Lanes a) { _mm256_storeu_si256(reinterpret_cast<__m256i_u*>(to), a.x); }
inline Lanes all(std::int16_t x) { return {_mm256_set1_epi16(x)}; }
inline Lanes operator+(Lanes a, Lanes b) { return {_mm256_add_epi16(a.x, b.x)}; }
inline Lanes operator-(Lanes a, Lanes b) { return {_mm256_sub_epi16(a.x, b.x)}; }
inline Lanes operator&(Lanes a, Lanes b) { return {_mm256_and_si256(a.x, b.x)}; }
inline Lanes operator>(Lanes a, Lanes b) { return {_mm256_cmpgt_epi16(a.x, b.x)}; }
inline Lanes operator<<(Lanes a, int bits) { return {_mm256_sll_epi16(a.x, _mm_cvtsi32_si128(bits))}; }
inline Lanes high_product(Lanes a, Lanes b) { return {_mm256_mulhi_epi16(a.x, b.x)}; }
inline Lanes saturated_sum(Lanes a, Lanes b) { return {_mm256_adds_epi16(a.x, b.x)}; }
inline Lanes saturated_difference(Lanes a, Lanes b) { return {_mm256_subs_epi16(a.x, b.x)}; }

#elif defined(__SSE2__)

struct Lanes {
  __m128i x, y;
};
struct Sums {
  __m128i x, y;
};
inline Sums no_sums() { return {_mm_setzero_si128(), _mm_setzero_si128()}; }
inline Sums operator+(Sums a, Sums b) { return {_mm_add_epi32(a.x, b.x), _mm_add_epi32(a.y, b.y)}; }
inline Sums product(Lanes a, Lanes b) { return {_mm_madd_epi16(a.x, b.x), _mm_madd_epi16(a.y, b.y)}; }
inline Lanes load(const std::int16_t* from) {
  const auto* const halves = reinterpret_cast<const __m128i_u*>(from);
  return {_mm_loadu_si128(halves), _mm_loadu_si128(halves + 1)};
}
inline void store(std::int16_t* to, Lanes a) {
  auto* const halves = reinterpret_cast<__m128i_u*>(to);
  _mm_storeu_si128(halves, a.x);
  _mm_storeu_si128(halves + 1, a.y);
}
inline Lanes all(std::int16_t x) { return {_mm_set1_epi16(x), _mm_set1_epi16(x)}; }
inline Lanes operator+(Lanes a, Lanes b) { return {_mm_add_epi16(a.x, b.x), _mm_add_epi16(a.y, b.y)}; }
inline Lanes operator-(Lanes a, Lanes b) { return {_mm_sub_epi16(a.x, b.x), _mm_sub_epi16(a.y, b.y)}; }
inline Lanes operator&(Lanes a, Lanes b) { return {_mm_and_si128(a.x, b.x), _mm_and_si128(a.y, b.y)}; }
inline Lanes operator>(Lanes a, Lanes b) { return {_mm_cmpgt_epi16(a.x, b.x), _mm_cmpgt_epi16(a.y, b.y)}; }
inline Lanes operator<<(Lanes a, int bits) {
  return {_mm_sll_epi16(a.x, _mm_cvtsi32_si128(bits)), _mm_sll_epi16(a.y, _mm_cvtsi32_si128(bits))};
}
inline Lanes high_product(Lanes a, Lanes b) { return {_mm_mulhi_epi16(a.x, b.x), _mm_mulhi_epi16(a.y, b.y)}; }
inline Lanes saturated_sum(Lanes a, Lanes b) { return {_mm_adds_epi16(a.x, b.x), _mm_adds_epi16(a.y, b.y)}; }
inline Lanes saturated_difference(Lanes a, Lanes b) {
  return {_mm_subs_epi16(a.x, b.x), _mm_subs_epi16(a.y, b.y)};
}

#elif defined(__aarch64__)

struct Lanes {
  int16x8_t x, y;
};
struct Sums {
  int32x4_t x, y;
};
inline Sums no_sums() { return {vdupq_n_s32(0), vdupq_n_s32(0)}; }
inline Sums operator+(Sums a, Sums b) { return {vaddq_s32(a.x, b.x), vaddq_s32(a.y, b.y)}; }
inline int32x4_t product(int16x8_t a, int16x8_t b) {
  return vaddq_s32(vmull_s16(vget_low_s16(a), vget_low_s16(b)), vmull_high_s16(a, b));
}
inline Sums product(Lanes a, Lanes b) { return {product(a.x, b.x), product(a.y, b.y)}; }
inline Lanes load(const std::int16_t* from) { return {vld1q_s16(from), vld1q_s16(from + 8)}; }
inline void store(std::int16_t* to, Lanes a) {
  vst1q_s16(to, a.x);
  vst1q_s16(to + 8, a.y);
}
inline Lanes all(std::int16_t x) { return {vdupq_n_s16(x), vdupq_n_s16(x)}; }
inline Lanes operator+(Lanes a, Lanes b) { return {vaddq_s16(a.x, b.x), vaddq_s16(a.y, b.y)}; }
inline Lanes operator-(Lanes a, Lanes b) { return {vsubq_s16(a.x, b.x), vsubq_s16(a.y, b.y)}; }
inline Lanes operator&(Lanes a, Lanes b) { return {vandq_s16(a.x, b.x), vandq_s16(a.y, b.y)}; }
inline Lanes operator>(Lanes a, Lanes b) {
  return {vreinterpretq_s16_u16(vcgtq_s16(a.x, b.x)), vreinterpretq_s16_u16(vcgtq_s16(a.y, b.y))};
}
inline Lanes operator<<(Lanes a, int bits) {
  const int16x8_t by = vdupq_n_s16(static_cast<std::int16_t>(bits));
  return {vshlq_s16(a.x, by), vshlq_s16(a.y, by)};
}
inline int16x8_t high_product(int16x8_t a, int16x8_t b) {
  const int16x4_t low = vshrn_n_s32(vmull_s16(vget_low_s16(a), vget_low_s16(b)), 16);
  return vshrn_high_n_s32(low, vmull_high_s16(a, b), 16);
}
inline Lanes high_product(Lanes a, Lanes b) { return {high_product(a.x, b.x), high_product(a.y, b.y)}; }
inline Lanes saturated_sum(Lanes a, Lanes b) { return {vqaddq_s16(a.x, b.x), vqaddq_s16(a.y, b.y)}; }
inline Lanes saturated_difference(Lanes a, Lanes b) { return {vqsubq_s16(a.x, b.x), vqsubq_s16(a.y, b.y)}; }

#else

struct Lanes {
  std::int16_t lane[kLanes];
};
struct Sums {
  std::uint32_t lane[kLanes / 2];
};
inline Sums no_sums() { return {}; }
inline Sums operator+(const Sums& a, const Sums& b) {
  Sums sums;
  for (std::uint32_t i = 0; i < kLanes / 2; ++i) sums.lane[i] = a.lane[i] + b.lane[i];
  return sums;
}
inline Sums product(const Lanes& a, const Lanes& b) {
  Sums sums;
  for (std::uint32_t i = 0; i < kLanes / 2; ++i) {
    sums.lane[i] = static_cast<std::uint32_t>(a.lane[2 * i] * b.lane[2 * i]) +
                   static_cast<std::uint32_t>(a.lane[2 * i + 1] * b.lane[2 * i + 1]);
  }
  return sums;
}
template <class F>
inline Lanes each(F f) {
  Lanes result;
  for (std::uint32_t i = 0; i < kLanes; ++i) result.lane[i] = static_cast<std::int16_t>(f(i));
  return result;
}
inline std::int32_t saturated(std::int32_t x) { return x > 32767 ? 32767 : x < -32768 ? -32768 : x; }
inline Lanes load(const std::int16_t* from) {
  return each([&](std::uint32_t i) { return from[i]; });
}
inline void store(std::int16_t* to, const Lanes& a) {
  for (std::uint32_t i = 0; i < kLanes; ++i) to[i] = a.lane[i];
}
inline Lanes all(std::int16_t x) {
  return each([&](std::uint32_t) { return x; });
}
inline Lanes operator+(const Lanes& a, const Lanes& b) {
  return each([&](std::uint32_t i) { return a.lane[i] + b.lane[i]; });
}
inline Lanes operator-(const Lanes& a, const Lanes& b) {
  return each([&](std::uint32_t i) { return a.lane[i] - b.lane[i]; });
}
inline Lanes operator&(const Lanes& a, const Lanes& b) {
  return each([&](std::uint32_t i) { return a.lane[i] & b.lane[i]; });
}
inline Lanes operator>(const Lanes& a, const Lanes& b) {
  return each([&](std::uint32_t i) { return a.lane[i] > b.lane[i] ? -1 : 0; });
}
inline Lanes operator<<(const Lanes& a, int bits) {
  return each([&](std::uint32_t i) { return a.lane[i] * (1 << bits); });
}
inline Lanes high_product(const Lanes& a, const Lanes& b) {
  return each([&](std::uint32_t i) { return (a.lane[i] * b.lane[i]) >> 16; });
}
inline Lanes saturated_sum(const Lanes& a, const Lanes& b) {
  return each([&](std::uint32_t i) { return saturated(a.lane[i] + b.lane[i]); });
}
inline Lanes saturated_difference(const Lanes& a, const Lanes& b) {
  return each([&](std::uint32_t i) { return saturated(a.lane[i] - b.lane[i]); });
}

#endif

/// Sum of all, wrapped.
inline std::int32_t sum_of(const Sums& a) {
#if defined(__AVX2__) || defined(__SSE2__)
#if defined(__AVX2__)
  __m128i sum = _mm_add_epi32(_mm256_castsi256_si128(a.x), _mm256_extracti128_si256(a.x, 1));
#else
  __m128i sum = _mm_add_epi32(a.x, a.y);
#endif
  sum = _mm_add_epi32(sum, _mm_unpackhi_epi64(sum, sum));
  sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, 1));
  return _mm_cvtsi128_si32(sum);
#elif defined(__aarch64__)
  return vaddvq_s32(vaddq_s32(a.x, a.y));
#else
  std::uint32_t sum = 0;
  for (const std::uint32_t x : a.lane) sum += x;
  return static_cast<std::int32_t>(sum);
#endif
}

}  // namespace
}  // namespace tandem
