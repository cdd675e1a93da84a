#pragma once
// A body as the hot loops read it.

#include <cstdint>

namespace tandem::engine {

/// Half a cache line.
struct alignas(32) Record {
  float x, y, z, radius;
  float vx, vy, vz;
  std::uint32_t slot;
};
static_assert(sizeof(Record) == 32);

/// The slot of a place that no body has any more.
inline constexpr std::uint32_t kNoSlot = UINT32_MAX;
/// Where such a place is: so far away that it touches nobody.
inline constexpr float kNowhere = 1e30F;

}  // namespace tandem::engine
