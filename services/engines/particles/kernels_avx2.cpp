// The kernels for AVX2. Compiled with -mavx2; called only where the processor has it.
#include <immintrin.h>

#include <array>

#include "services/engines/particles/kernels.hpp"
#include "services/engines/particles/kernels_any.hpp"
#include "services/engines/particles/lanes_avx2.hpp"

namespace tandem::engine {
namespace {

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

// `whole`: what lies behind the ends of the runs may be looked at.
template <bool whole>
std::uint32_t collect_of(const Anchors anchors, std::span<const Run> runs, const Seeker& seeker,
                         std::uint32_t enough, std::uint32_t* out) {
  constexpr std::uint32_t kLanes = 8;
  const __m256 x = _mm256_set1_ps(seeker.x), y = _mm256_set1_ps(seeker.y), z = _mm256_set1_ps(seeker.z);
  const __m256 own = _mm256_set1_ps(seeker.reach);
  const __m256i self = _mm256_set1_epi32(static_cast<int>(seeker.self));
  const __m256i steps = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  std::uint32_t count = 0;
  for (const Run run : runs) {
    for (std::uint32_t i = run.begin; i < run.end && count < enough; i += kLanes) {
      const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(anchors.x + i), x);
      const __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(anchors.y + i), y);
      const __m256 dz = _mm256_sub_ps(_mm256_loadu_ps(anchors.z + i), z);
      const __m256 squared =
          _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
      const __m256 reach = _mm256_add_ps(own, _mm256_loadu_ps(anchors.radius + i));
      const __m256i places = whole || anchors.place != nullptr
                                 ? _mm256_loadu_si256(reinterpret_cast<const __m256i*>(anchors.place + i))
                                 : _mm256_add_epi32(steps, _mm256_set1_epi32(static_cast<int>(i)));
      const __m256 itself = _mm256_castsi256_ps(_mm256_cmpeq_epi32(places, self));
      auto near = static_cast<std::uint32_t>(_mm256_movemask_ps(
          _mm256_andnot_ps(itself, _mm256_cmp_ps(squared, _mm256_mul_ps(reach, reach), _CMP_LT_OQ))));
      if (!whole && run.end - i < kLanes) near &= (1U << (run.end - i)) - 1U;
      const __m256i order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kPacking[near])));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + count),
                          _mm256_permutevar8x32_epi32(places, order));
      count += static_cast<std::uint32_t>(__builtin_popcount(near));
    }
  }
  return count;
}

std::uint32_t collect(const Anchors& anchors, std::span<const Run> runs, const Seeker& seeker,
                      std::uint32_t enough, std::uint32_t* out) {
  return collect_of<false>(anchors, runs, seeker, enough, out);
}

std::uint32_t collect_packed(const Vicinity& vicinity, const Seeker& seeker, std::uint32_t enough,
                             std::uint32_t* out) {
  const Run all = vicinity.all();
  return collect_of<true>(vicinity.anchors(), {&all, 1}, seeker, enough, out);
}

}  // namespace

const Kernels kAvx2Kernels{&integrate<Eight>,  &judge_speeds<Eight>, &add_partners<Eight>,
                           &add_planes<Eight>, &pack<Eight>,         &collect,
                           &collect_packed};

}  // namespace tandem::engine
