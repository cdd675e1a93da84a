#pragma once
// The inner loops of the contacts, in several instruction sets. Each adds a body's forces one after the other
// in the order that it is given, so that all of them give the same bits.

#include <array>
#include <cstdint>
#include <span>

#include "services/engines/common/world.hpp"
#include "services/engines/particles/grid.hpp"
#include "services/engines/particles/particles.hpp"
#include "services/engines/particles/record.hpp"

namespace tandem::engine {

/// Bodies in consecutive places that are computed side by side.
inline constexpr std::uint32_t kGroup = 16;

/// Forces on the bodies of a group.
struct Forces {
  alignas(64) float x[kGroup], y[kGroup], z[kGroup];
};

/// The forces on a group's bodies so far.
struct Sums : Forces {
  std::uint32_t touching;  ///< a bit a body
};

/// Which bodies of a group there are, and which are slow or fast; a bit a body.
struct Speeds {
  std::uint32_t living, slow, fast;
};

/// A step of all bodies: equation 3.1, and what they must stay near to and within.
struct Advance {
  float h, keep;
  Vec3f kick, drift, low, high;
  float far_squared;  ///< from the anchor
};

/// Bodies of a group that went too far; a bit a body.
struct Gone {
  std::uint32_t loose;    ///< from the anchor
  std::uint32_t outside;  ///< of the world
};

/// Where bodies are, and their radius, which is not a number for those that collect() must not find.
struct Anchors {
  const float *x, *y, *z, *radius;
  const std::uint32_t* place = nullptr;  ///< null: they are by place
};

/// Bodies that may be near, packed. Behind them are kGroup that collect_packed() does not find.
struct Vicinity {
  static constexpr std::uint32_t kMaxPlaces = kMaxNeighbours + kGroup;
  alignas(64) std::array<float, kMaxPlaces> x, y, z, radius;
  alignas(64) std::array<std::uint32_t, kMaxPlaces> place;
  std::uint32_t count = 0;
  [[nodiscard]] Anchors anchors() const {
    return {x.data(), y.data(), z.data(), radius.data(), place.data()};
  }
  [[nodiscard]] Run all() const { return {0, count}; }
};

/// What one body looks for.
struct Seeker {
  float x, y, z;
  float reach;         ///< its radius and the skin
  std::uint32_t self;  ///< a place that it must not find
};

struct Kernels {
  /// Moves the living bodies of the group from place `first` on.
  void (*integrate)(Record* records, const Forces& forces, const float* inverse_mass, const Anchors& anchors,
                    std::uint32_t first, const Advance& motion, Gone& gone);
  /// Compares squares of speeds with `slow` and `fast`.
  void (*judge_speeds)(const Record* records, std::uint32_t first, float slow, float fast, Speeds& out);
  /// Adds the forces of `rows` partners of each of the bodies from place `first` on. entries[row * kGroup +
  /// i] is the partner's place, or that of a record that is nowhere.
  void (*add_partners)(const Record* records, std::uint32_t first, const std::uint32_t* entries,
                       std::uint32_t rows, const Material& material, Sums& sums);
  /// Adds the forces of planes.
  void (*add_planes)(const Record* records, std::uint32_t first, std::span<const Plane> planes,
                     const Material& material, Sums& sums);
  /// Sets `out` to the bodies of `runs`, in their order. Reads up to kGroup elements too many.
  void (*pack)(const Anchors& anchors, std::span<const Run> runs, Vicinity& out);
  /// Writes the places of the bodies of `runs` that are near to `out`, in their order, and stops some time
  /// after `enough`; returns their number. Writes up to kGroup elements beyond `enough`. Reads up to kGroup
  /// elements too many.
  std::uint32_t (*collect)(const Anchors& anchors, std::span<const Run> runs, const Seeker& seeker,
                           std::uint32_t enough, std::uint32_t* out);
  /// The same for all of `vicinity`, faster.
  std::uint32_t (*collect_packed)(const Vicinity& vicinity, const Seeker& seeker, std::uint32_t enough,
                                  std::uint32_t* out);
};

/// Kernels in `instructions`, or the best that this processor has.
[[nodiscard]] const Kernels& kernels(Instructions instructions);

extern const Kernels kScalarKernels;
#ifdef TANDEM_ENGINE_AVX
extern const Kernels kAvx2Kernels, kAvx512Kernels;
#endif

}  // namespace tandem::engine
