// Eight bodies side by side, for kernels_any.hpp. Included only where the compiler may use AVX2.
#pragma once

#include <immintrin.h>

#include "services/engines/particles/kernels.hpp"
#include "services/engines/particles/kernels_any.hpp"

namespace tandem::engine {
namespace {

struct Eight {
  using F = __m256;
  using Mask = __m256;
  static constexpr std::uint32_t kLanes = 8;
  static F all(float v) { return _mm256_set1_ps(v); }
  static F load(const float* from) { return _mm256_load_ps(from); }
  static F load_any(const float* from) { return _mm256_loadu_ps(from); }
  static void store(float* to, F v) { _mm256_store_ps(to, v); }
  static F add(F a, F b) { return _mm256_add_ps(a, b); }
  static F sub(F a, F b) { return _mm256_sub_ps(a, b); }
  static F mul(F a, F b) { return _mm256_mul_ps(a, b); }
  static F divide(F a, F b) { return _mm256_div_ps(a, b); }
  static F root(F a) { return _mm256_sqrt_ps(a); }
  static Mask less(F a, F b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
  static Mask within(F low, F a, F high) {
    return _mm256_and_ps(_mm256_cmp_ps(a, low, _CMP_GE_OQ), _mm256_cmp_ps(a, high, _CMP_LE_OQ));
  }
  static std::uint32_t bits(Mask m) { return static_cast<std::uint32_t>(_mm256_movemask_ps(m)); }
  static F keep(Mask m, F a) { return _mm256_and_ps(m, a); }
  static F choose(Mask m, F a, F b) { return _mm256_blendv_ps(b, a, m); }
  static F later(const std::uint32_t* a, const std::uint32_t* b) {
    const auto at = [](const std::uint32_t* from) {
      return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
    };
    const __m256i greater = _mm256_cmpgt_epi32(at(a), at(b));  // places are below 2^31
    return _mm256_blendv_ps(all(-1), all(1), _mm256_castsi256_ps(greater));
  }
  static void count_up(std::uint32_t* to, std::uint32_t from) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                        _mm256_add_epi32(_mm256_set1_epi32(static_cast<int>(from)),
                                         _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)));
  }
  // Halves of records 0 and 4, 1 and 5, 2 and 6, 3 and 7, turned into columns.
  static void turn(const float* const (&from)[8], F& a, F& b, F& c, F& d) {
    const auto pair = [&from](int i) {
      return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(from[i])), _mm_load_ps(from[i + 4]), 1);
    };
    const F r0 = pair(0), r1 = pair(1), r2 = pair(2), r3 = pair(3);
    const F t0 = _mm256_unpacklo_ps(r0, r1), t1 = _mm256_unpackhi_ps(r0, r1);
    const F t2 = _mm256_unpacklo_ps(r2, r3), t3 = _mm256_unpackhi_ps(r2, r3);
    a = _mm256_shuffle_ps(t0, t2, 0x44);
    b = _mm256_shuffle_ps(t0, t2, 0xEE);
    c = _mm256_shuffle_ps(t1, t3, 0x44);
    d = _mm256_shuffle_ps(t1, t3, 0xEE);
  }
  static void gather_places(const Record* records, const std::uint32_t* places, Lanes<Eight>& out) {
    const float* from[8];
    for (std::size_t i = 0; i < 8; ++i) from[i] = &records[places[i]].x;
    turn(from, out.x, out.y, out.z, out.radius);
  }
  static void gather_motion(const Record* records, const std::uint32_t* places, Lanes<Eight>& out) {
    const float* from[8];
    for (std::size_t i = 0; i < 8; ++i) from[i] = &records[places[i]].vx;
    F slots;
    turn(from, out.vx, out.vy, out.vz, slots);
  }
  static void load_records(const Record* from, Lanes<Eight>& out) {
    const float *places[8], *motions[8];
    for (std::size_t i = 0; i < 8; ++i) {
      places[i] = &from[i].x;
      motions[i] = &from[i].vx;
    }
    turn(places, out.x, out.y, out.z, out.radius);
    turn(motions, out.vx, out.vy, out.vz, out.slot);
  }
  // Columns turned into the halves of records, of those that live.
  static void store_halves(F a, F b, F c, F d, std::uint32_t living, float* to, std::size_t stride) {
    const F t0 = _mm256_unpacklo_ps(a, b), t1 = _mm256_unpackhi_ps(a, b);
    const F t2 = _mm256_unpacklo_ps(c, d), t3 = _mm256_unpackhi_ps(c, d);
    const F r[4] = {_mm256_shuffle_ps(t0, t2, 0x44), _mm256_shuffle_ps(t0, t2, 0xEE),
                    _mm256_shuffle_ps(t1, t3, 0x44), _mm256_shuffle_ps(t1, t3, 0xEE)};
    if (living == 0xFF) {
      for (std::size_t i = 0; i < 4; ++i) {
        _mm_store_ps(to + i * stride, _mm256_castps256_ps128(r[i]));
        _mm_store_ps(to + (i + 4) * stride, _mm256_extractf128_ps(r[i], 1));
      }
      return;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      if ((living >> i & 1U) != 0) _mm_store_ps(to + i * stride, _mm256_castps256_ps128(r[i]));
      if ((living >> (i + 4) & 1U) != 0) _mm_store_ps(to + (i + 4) * stride, _mm256_extractf128_ps(r[i], 1));
    }
  }
  static void store_records(const Lanes<Eight>& v, std::uint32_t living, Record* to) {
    constexpr std::size_t kStride = sizeof(Record) / sizeof(float);
    store_halves(v.x, v.y, v.z, v.radius, living, &to->x, kStride);
    store_halves(v.vx, v.vy, v.vz, v.slot, living, &to->vx, kStride);
  }
  static std::uint32_t living(F slot) {
    return ~bits(_mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_castps_si256(slot), _mm256_set1_epi32(-1)))) &
           0xFFU;
  }
};

}  // namespace
}  // namespace tandem::engine
