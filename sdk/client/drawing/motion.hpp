#pragma once
// The inner loops of sampling: one axis of a run of slots. They compute in floats, because a drawn place
// needs no more digits than the caller's floats have. Units are lattice units and lattice units per frame.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/client/drawing/smoothing.hpp"

namespace tandem::client {

/// Number of slots processed together; a run stays in the first-level cache.
inline constexpr std::size_t kRun = 256;
using Numbers = std::array<float, kRun>;
/// Lattice units per frame of the unit in which the state holds velocities.
inline constexpr float kVelocityScale = 1.0F / 64;

/// Times of a SampledMoment that are the same for all bodies.
struct Span {
  float after = 0, since = 0, gap = 0, pace = 1;
};

/// The part of some bodies' motion at this moment that their velocity does not contain: place, velocity, and
/// how far it moved the body since the previous sample.
struct Extra {
  Numbers place, way, speed;
};

/// Reads the predicted velocities: 1/64 unit per frame.
void read_speeds(const std::int32_t* v, std::size_t count, float* speeds);
/// Computes velocities from the way between two frames. The velocity is 0 if the counts of jumps differ,
/// because a body that spawned or teleported in between never moved from one place to the other.
void read_ways(const std::int32_t* from, const std::int32_t* to, const std::uint8_t* jumps_from,
               const std::uint8_t* jumps_to, std::size_t count, float* speeds);

/// Advances `shown_place` and `shown_speed` from the previous sample to this one. The eye expects the drawn
/// place to move on with the motion; the difference to the true place is a correction. `extra` may be null.
void show(const std::int32_t* places, const float* speeds, const Extra* extra, std::size_t count,
          const Span& span, const Smoothing& smoothing, float* shown_place, float* shown_speed);

/// Writes vectors x y z, scaled. `stride` is in bytes; any alignment.
void put_vectors(const float* x, const float* y, const float* z, float scale, std::size_t count,
                 std::byte* to, std::size_t stride);

}  // namespace tandem::client
