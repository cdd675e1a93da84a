// The kernels for AVX2. Compiled with -mavx2; called only where the processor has it.
#include <immintrin.h>

#include <array>

#include "services/engine/particles/kernels.hpp"
#include "services/engine/particles/kernels_any.hpp"

namespace tandem::engine {
namespace {

struct Eight {
  using F = __m256;
  using Mask = __m256;
  static constexpr std::uint32_t kLanes = 8;
  static F all(float v) { return _mm256_set1_ps(v); }
  static F load(const float* from) { return _mm256_load_ps(from); }
  static void store(float* to, F v) { _mm256_store_ps(to, v); }
  static F add(F a, F b) { return _mm256_add_ps(a, b); }
  static F sub(F a, F b) { return _mm256_sub_ps(a, b); }
  static F mul(F a, F b) { return _mm256_mul_ps(a, b); }
  static F divide(F a, F b) { return _mm256_div_ps(a, b); }
  static F root(F a) { return _mm256_sqrt_ps(a); }
  static Mask less(F a, F b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
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
};

// For each set of lanes, their numbers one after the other, a byte each.
constexpr std::array<std::uint64_t, 256> packing() {
  std::array<std::uint64_t, 256> table{};
  for (std::uint32_t set = 0; set < 256; ++set) {
    std::uint32_t at = 0;
    for (std::uint64_t lane = 0; lane < 8; ++lane) {
      if ((set >> lane & 1U) != 0) table[set] |= lane << (8 * at++);
    }
  }
  return table;
}
constexpr std::array<std::uint64_t, 256> kPacking = packing();

std::uint32_t collect(const Vicinity& vicinity, const Seeker& seeker, std::uint32_t enough,
                      std::uint32_t* out) {
  const __m256 x = _mm256_set1_ps(seeker.x), y = _mm256_set1_ps(seeker.y), z = _mm256_set1_ps(seeker.z);
  const __m256 own = _mm256_set1_ps(seeker.reach);
  const __m256i self = _mm256_set1_epi32(static_cast<int>(seeker.self));
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < vicinity.count && (i % kGroup != 0 || count < enough); i += 8) {
    const __m256 dx = _mm256_sub_ps(_mm256_load_ps(&vicinity.x[i]), x);
    const __m256 dy = _mm256_sub_ps(_mm256_load_ps(&vicinity.y[i]), y);
    const __m256 dz = _mm256_sub_ps(_mm256_load_ps(&vicinity.z[i]), z);
    const __m256 squared =
        _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
    const __m256 reach = _mm256_add_ps(own, _mm256_load_ps(&vicinity.radius[i]));
    const __m256i places = _mm256_load_si256(reinterpret_cast<const __m256i*>(&vicinity.place[i]));
    const __m256 itself = _mm256_castsi256_ps(_mm256_cmpeq_epi32(places, self));
    const auto near = static_cast<std::uint32_t>(_mm256_movemask_ps(
        _mm256_andnot_ps(itself, _mm256_cmp_ps(squared, _mm256_mul_ps(reach, reach), _CMP_LT_OQ))));
    const __m256i order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kPacking[near])));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + count), _mm256_permutevar8x32_epi32(places, order));
    count += static_cast<std::uint32_t>(__builtin_popcount(near));
  }
  return count;
}

}  // namespace

const Kernels kAvx2Kernels{&add_partners<Eight>, &add_planes<Eight>, &pack<Eight>, &collect};

}  // namespace tandem::engine
