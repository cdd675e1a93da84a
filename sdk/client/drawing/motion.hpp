#pragma once
// The inner loops of sampling: one axis of a run of slots. Floats: a place needs no more digits than the
// caller's own have. Lattice units, and those per frame.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/client/drawing/smoothing.hpp"

namespace tandem::client {

/// Slots are worked on in runs that stay in the first cache.
inline constexpr std::size_t kRun = 256;
using Numbers = std::array<float, kRun>;

/// Spans of a SampledMoment that all bodies share.
struct Span {
  float after = 0, since = 0, gap = 0, pace = 1;
};

/// What some bodies' motion has beyond its velocity, at this moment: place and velocity, and how far that
/// carried it since the previous sample.
struct Extra {
  Numbers place, way, speed;
};

/// Velocities as they are foreseen: 1/64 unit per frame.
void read_speeds(const std::int32_t* v, std::size_t count, float* speeds);
/// Those of the way between two frames; none where the counts of jumps differ: what spawned or teleported in
/// between was never on the way from one place to the other.
void read_ways(const std::int32_t* from, const std::int32_t* to, const std::uint8_t* jumps_from,
               const std::uint8_t* jumps_to, std::size_t count, float* speeds);

/// Takes `shown_place` and `shown_speed` from the previous sample to this one. What was drawn, carried on
/// with the motion, is where the eye expects it; the rest is a correction. `extra` may be null.
void show(const std::int32_t* places, const float* speeds, const Extra* extra, std::size_t count,
          const Span& span, const Smoothing& smoothing, float* shown_place, float* shown_speed);

/// x y z x y z ..., scaled. `stride` in bytes, any alignment.
void put_vectors(const float* x, const float* y, const float* z, float scale, std::size_t count,
                 std::byte* to, std::size_t stride);

}  // namespace tandem::client
