#pragma once
// Eight 16-bit integers at once: what SSE2, NEON and WebAssembly all have, with the same bits everywhere.

#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace tandem {

/// Sums wrap, comparisons give 0 or -1, shifts keep the sign.
using Lanes16 = std::int16_t __attribute__((vector_size(16)));

inline constexpr std::uint32_t kLanes16 = 8;

[[nodiscard]] inline Lanes16 all_lanes(std::int32_t x) {
  const auto lane = static_cast<std::int16_t>(x);
  return Lanes16{lane, lane, lane, lane, lane, lane, lane, lane};
}

[[nodiscard]] inline Lanes16 load_lanes(const std::int16_t* from) {
  Lanes16 lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}

inline void store_lanes(std::int16_t* to, Lanes16 lanes) { std::memcpy(to, &lanes, sizeof lanes); }

#if defined(__SSE2__)

/// (a * b) >> 16
[[nodiscard]] inline Lanes16 high_product(Lanes16 a, Lanes16 b) {
  return reinterpret_cast<Lanes16>(
      _mm_mulhi_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
}
/// a + b, a - b within -32768 .. 32767
[[nodiscard]] inline Lanes16 saturated_sum(Lanes16 a, Lanes16 b) {
  return reinterpret_cast<Lanes16>(
      _mm_adds_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
}
[[nodiscard]] inline Lanes16 saturated_difference(Lanes16 a, Lanes16 b) {
  return reinterpret_cast<Lanes16>(
      _mm_subs_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
}

#elif defined(__aarch64__)

[[nodiscard]] inline Lanes16 high_product(Lanes16 a, Lanes16 b) {
  const auto x = reinterpret_cast<int16x8_t>(a);
  const auto y = reinterpret_cast<int16x8_t>(b);
  const int16x4_t low = vshrn_n_s32(vmull_s16(vget_low_s16(x), vget_low_s16(y)), 16);
  return reinterpret_cast<Lanes16>(vshrn_high_n_s32(low, vmull_high_s16(x, y), 16));
}
[[nodiscard]] inline Lanes16 saturated_sum(Lanes16 a, Lanes16 b) {
  return reinterpret_cast<Lanes16>(
      vqaddq_s16(reinterpret_cast<int16x8_t>(a), reinterpret_cast<int16x8_t>(b)));
}
[[nodiscard]] inline Lanes16 saturated_difference(Lanes16 a, Lanes16 b) {
  return reinterpret_cast<Lanes16>(
      vqsubq_s16(reinterpret_cast<int16x8_t>(a), reinterpret_cast<int16x8_t>(b)));
}

#else

namespace lanes_detail {
using Wide = std::int32_t __attribute__((vector_size(32)));
[[nodiscard]] inline Wide widened(Lanes16 a) { return __builtin_convertvector(a, Wide); }
[[nodiscard]] inline Lanes16 saturated(Wide x) {
  const Wide high = x > 32767;
  const Wide low = x < -32768;
  return __builtin_convertvector((x & ~(high | low)) | (high & 32767) | (low & -32768), Lanes16);
}
}  // namespace lanes_detail

[[nodiscard]] inline Lanes16 high_product(Lanes16 a, Lanes16 b) {
  return __builtin_convertvector((lanes_detail::widened(a) * lanes_detail::widened(b)) >> 16, Lanes16);
}
[[nodiscard]] inline Lanes16 saturated_sum(Lanes16 a, Lanes16 b) {
  return lanes_detail::saturated(lanes_detail::widened(a) + lanes_detail::widened(b));
}
[[nodiscard]] inline Lanes16 saturated_difference(Lanes16 a, Lanes16 b) {
  return lanes_detail::saturated(lanes_detail::widened(a) - lanes_detail::widened(b));
}

#endif

/// Sum of the eight, wrapped.
[[nodiscard]] inline std::int16_t sum_of(Lanes16 a) {
  std::uint32_t sum = 0;
  for (std::uint32_t i = 0; i < kLanes16; ++i) sum += static_cast<std::uint16_t>(a[i]);
  return static_cast<std::int16_t>(sum);
}

}  // namespace tandem
