// The kernels for AVX-512. Compiled with its options; called only where the processor has it.
#include <immintrin.h>

#include "services/engines/particles/kernels.hpp"
#include "services/engines/particles/kernels_any.hpp"
#include "services/engines/particles/lanes_avx2.hpp"

namespace tandem::engine {
namespace {

struct Sixteen {
  using F = __m512;
  using Mask = __mmask16;
  static constexpr std::uint32_t kLanes = 16;
  static constexpr Mask kAll = 0xFFFF;  // GCC 12 warns of the forms without a mask (bug 105593)
  static F all(float v) { return _mm512_set1_ps(v); }
  static F load(const float* from) { return _mm512_load_ps(from); }
  static void store(float* to, F v) { _mm512_store_ps(to, v); }
  static F add(F a, F b) { return _mm512_add_ps(a, b); }
  static F sub(F a, F b) { return _mm512_sub_ps(a, b); }
  static F mul(F a, F b) { return _mm512_mul_ps(a, b); }
  static F divide(F a, F b) { return _mm512_div_ps(a, b); }
  static F root(F a) { return _mm512_maskz_sqrt_ps(kAll, a); }
  static Mask less(F a, F b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
  static std::uint32_t bits(Mask m) { return m; }
  static F keep(Mask m, F a) { return _mm512_maskz_mov_ps(m, a); }
  static F choose(Mask m, F a, F b) { return _mm512_mask_mov_ps(b, m, a); }
  static F later(const std::uint32_t* a, const std::uint32_t* b) {
    const Mask greater = _mm512_cmpgt_epu32_mask(_mm512_loadu_si512(a), _mm512_loadu_si512(b));
    return _mm512_mask_mov_ps(all(-1), greater, all(1));
  }
  static void count_up(std::uint32_t* to, std::uint32_t from) {
    const __m512i steps = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    _mm512_storeu_si512(to, _mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(from)), steps));
  }
  // Halves of records 0, 4, 8, 12 and so on, turned into columns.
  static void turn(const float* const (&from)[16], F& a, F& b, F& c, F& d) {
    const auto four = [&from](int i) {
      __m512 r = _mm512_castps128_ps512(_mm_load_ps(from[i]));
      r = _mm512_insertf32x4(r, _mm_load_ps(from[i + 4]), 1);
      r = _mm512_insertf32x4(r, _mm_load_ps(from[i + 8]), 2);
      return _mm512_insertf32x4(r, _mm_load_ps(from[i + 12]), 3);
    };
    const F r0 = four(0), r1 = four(1), r2 = four(2), r3 = four(3);
    const F t0 = _mm512_maskz_unpacklo_ps(kAll, r0, r1), t1 = _mm512_maskz_unpackhi_ps(kAll, r0, r1);
    const F t2 = _mm512_maskz_unpacklo_ps(kAll, r2, r3), t3 = _mm512_maskz_unpackhi_ps(kAll, r2, r3);
    a = _mm512_shuffle_ps(t0, t2, 0x44);
    b = _mm512_shuffle_ps(t0, t2, 0xEE);
    c = _mm512_shuffle_ps(t1, t3, 0x44);
    d = _mm512_shuffle_ps(t1, t3, 0xEE);
  }
  static void gather_places(const Record* records, const std::uint32_t* places, Lanes<Sixteen>& out) {
    const float* from[16];
    for (std::size_t i = 0; i < 16; ++i) from[i] = &records[places[i]].x;
    turn(from, out.x, out.y, out.z, out.radius);
  }
  static void gather_motion(const Record* records, const std::uint32_t* places, Lanes<Sixteen>& out) {
    const float* from[16];
    for (std::size_t i = 0; i < 16; ++i) from[i] = &records[places[i]].vx;
    F slots;
    turn(from, out.vx, out.vy, out.vz, slots);
  }
  static void load_records(const Record* from, Lanes<Sixteen>& out) {
    const float *places[16], *motions[16];
    for (std::size_t i = 0; i < 16; ++i) {
      places[i] = &from[i].x;
      motions[i] = &from[i].vx;
    }
    turn(places, out.x, out.y, out.z, out.radius);
    turn(motions, out.vx, out.vy, out.vz, out.slot);
  }
};

std::uint32_t collect(const Anchors& anchors, std::span<const Run> runs, const Seeker& seeker,
                      std::uint32_t enough, std::uint32_t* out) {
  const __m512 x = _mm512_set1_ps(seeker.x), y = _mm512_set1_ps(seeker.y), z = _mm512_set1_ps(seeker.z);
  const __m512 own = _mm512_set1_ps(seeker.reach);
  const __m512i steps = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m512i self = _mm512_set1_epi32(static_cast<int>(seeker.self));
  std::uint32_t count = 0;
  for (const Run& run : runs) {
    const __m512i end = _mm512_set1_epi32(static_cast<int>(run.end));
    for (std::uint32_t i = run.begin; i < run.end && count < enough; i += 16) {
      const __m512 dx = _mm512_sub_ps(_mm512_loadu_ps(anchors.x + i), x);
      const __m512 dy = _mm512_sub_ps(_mm512_loadu_ps(anchors.y + i), y);
      const __m512 dz = _mm512_sub_ps(_mm512_loadu_ps(anchors.z + i), z);
      const __m512 squared =
          _mm512_add_ps(_mm512_add_ps(_mm512_mul_ps(dx, dx), _mm512_mul_ps(dy, dy)), _mm512_mul_ps(dz, dz));
      const __m512 reach = _mm512_add_ps(own, _mm512_loadu_ps(anchors.radius + i));
      const __m512i numbers = _mm512_add_epi32(steps, _mm512_set1_epi32(static_cast<int>(i)));
      const __m512i places = anchors.place == nullptr ? numbers : _mm512_loadu_si512(anchors.place + i);
      __mmask16 near = _mm512_mask_cmpneq_epi32_mask(_mm512_cmplt_epu32_mask(numbers, end), places, self);
      near = _mm512_mask_cmplt_ps_mask(near, squared, _mm512_mul_ps(reach, reach));
      _mm512_storeu_si512(out + count, _mm512_maskz_compress_epi32(near, places));
      count += static_cast<std::uint32_t>(__builtin_popcount(near));
    }
  }
  return count;
}

std::uint32_t collect_packed(const Vicinity& vicinity, const Seeker& seeker, std::uint32_t enough,
                             std::uint32_t* out) {
  const Run all = vicinity.all();
  return collect(vicinity.anchors(), {&all, 1}, seeker, enough, out);
}

}  // namespace

const Kernels kAvx512Kernels{&integrate<Eight>,    &judge_speeds<Eight>, &add_partners<Sixteen>,
                             &add_planes<Sixteen>, &pack<Sixteen>,       &collect,
                             &collect_packed};

}  // namespace tandem::engine
