#pragma once
// Which bodies are near one: a first look in words, several bodies at a time. It may find some that are not,
// and so it decides nothing. Everything here is inlined always: see ../words/lanes.hpp.

#include "sdk/core/predict/rigid/near.hpp"
#include "sdk/core/predict/rigid/word_pairs.hpp"

namespace tandem {

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
      std::uint32_t near = signs_of((dot16(d_xy, d_xy) >> 1) + (dot16(d_z, z_minus) >> 1));
      if (to - first < kLanes<V>) near &= (1U << (to - first)) - 1;
      for (; near != 0; near &= near - 1)
        out[count++] = first + static_cast<std::uint32_t>(__builtin_ctz(near));
    }
    return count;
  }
};

}  // namespace tandem
