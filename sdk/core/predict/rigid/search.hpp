#pragma once
// Which bodies are near one: a first look in words, several bodies at a time. It may find some that are not,
// and so it decides nothing. Everything here is inlined always: see ../contact/lanes.hpp.

#include "sdk/core/predict/rigid/near.hpp"
#include "sdk/core/predict/rigid/words.hpp"

namespace tandem {

/// In bit k whether lane k is below 0.
TANDEM_INLINE std::uint32_t signs_of(Four x) {
#if defined(__SSE2__)
  return static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(x)));
#elif defined(__wasm_simd128__)
  return wasm_i32x4_bitmask(wide(x));
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

template <class V>
struct RigidSearch {
  // Odd, so that none is -2^15.
  TANDEM_INLINE static V odd_differences(V a, V b) { return wrapped_differences(a, b) | 0x00010001; }

  /// Implements RigidFindNear.
  TANDEM_INLINE static std::size_t find(const RigidBalls& balls, std::uint32_t a, std::uint32_t from,
                                        std::uint32_t to, std::uint32_t* out) {
    const V xy = constant<V>(balls.xy[a]);
    const std::int32_t z = balls.z_radius[a];
    const V z_radius = words_of(constant<V>(z), -(high_word(constant<V>(z)) + RigidBalls::kSlack));
    std::size_t count = 0;
    for (std::uint32_t first = from; first < to; first += kLanes<V>) {
      const V d_xy = odd_differences(read<V>(balls.xy + first), xy);
      const V d_z = odd_differences(read<V>(balls.z_radius + first), z_radius);
      const V z_minus = high_negated(d_z);
      std::uint32_t near = signs_of((products(d_xy, d_xy) >> 1) + (products(d_z, z_minus) >> 1));
      if (to - first < kLanes<V>) near &= (1U << (to - first)) - 1;
      for (; near != 0; near &= near - 1)
        out[count++] = first + static_cast<std::uint32_t>(__builtin_ctz(near));
    }
    return count;
  }
};

}  // namespace tandem
