#include "sdk/client/drawing/motion.hpp"

#include <cstring>

#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem::client {
namespace {

template <bool kExtra>
[[gnu::always_inline]] inline void show_axis(const std::int32_t* __restrict places,
                                             const float* __restrict speeds, const Extra* __restrict extra,
                                             std::size_t count, Span span, Smoothing k,
                                             float* __restrict shown_place, float* __restrict shown_speed) {
  for (std::size_t i = 0; i < count; ++i) {
    float place = static_cast<float>(places[i]) + speeds[i] * span.after;
    float way = speeds[i] * span.since;
    float speed = speeds[i] * span.pace;
    if constexpr (kExtra) {
      place += extra->place[i];
      way += extra->way[i];
      speed += extra->speed[i];
    }
    const float beside = shown_place[i] + shown_speed[i] * span.gap + way - place;
    shown_place[i] = place + k.place * beside;
    shown_speed[i] = speed + k.speed * beside;
  }
}

}  // namespace

void read_speeds(const std::int32_t* v, std::size_t count, float* speeds) {
  for (std::size_t i = 0; i < count; ++i) speeds[i] = kVelocityScale * static_cast<float>(v[i]);
}

void read_ways(const std::int32_t* from, const std::int32_t* to, const std::uint8_t* jumps_from,
               const std::uint8_t* jumps_to, std::size_t count, float* speeds) {
  for (std::size_t i = 0; i < count; ++i) {
    const float on_the_way = jumps_from[i] == jumps_to[i] ? 1 : 0;
    speeds[i] = (static_cast<float>(to[i]) - static_cast<float>(from[i])) * on_the_way;
  }
}

TANDEM_VECTOR_CLONES
void show(const std::int32_t* places, const float* speeds, const Extra* extra, std::size_t count,
          const Span& span, const Smoothing& smoothing, float* shown_place, float* shown_speed) {
  if (extra != nullptr) {
    show_axis<true>(places, speeds, extra, count, span, smoothing, shown_place, shown_speed);
  } else {
    show_axis<false>(places, speeds, nullptr, count, span, smoothing, shown_place, shown_speed);
  }
}

void put_vectors(const float* x, const float* y, const float* z, float scale, std::size_t count,
                 std::byte* to, std::size_t stride) {
  constexpr std::size_t kPacked = 3 * sizeof(float);
  Numbers scaled_x, scaled_y, scaled_z;
  for (std::size_t i = 0; i < count; ++i) {
    scaled_x[i] = x[i] * scale;
    scaled_y[i] = y[i] * scale;
    scaled_z[i] = z[i] * scale;
  }
  const auto store = [&](std::size_t step) {
    for (std::size_t i = 0; i < count; ++i, to += step) {
      std::memcpy(to, &scaled_x[i], sizeof(float));
      std::memcpy(to + sizeof(float), &scaled_y[i], sizeof(float));
      std::memcpy(to + 2 * sizeof(float), &scaled_z[i], sizeof(float));
    }
  };
  stride == kPacked ? store(kPacked) : store(stride);  // the compiler unrolls a constant stride
}

}  // namespace tandem::client
