#pragma once
// Uniform cells (thesis, section 3.2.1; S. Green 2008): bodies sorted so that those of a cell, and of cells
// that are neighbours along x, lie next to each other.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/engine/common/world.hpp"

namespace tandem::engine {

/// The part of a body that the contact loop reads: half a cache line.
struct Record {
  float x, y, z, radius;
  float vx, vy, vz;
  std::uint32_t slot;
};
static_assert(sizeof(Record) == 32);

/// Records [begin, end).
struct Run {
  std::uint32_t begin = 0, end = 0;
};

/// Maximum number of bodies of a cell that take part in contacts, which bounds a step if all bodies are in
/// one place. The other bodies of the cell meet no body. A cell holds 16 equal spheres that are squeezed to
/// half their diameter.
inline constexpr std::uint32_t kMaxInCell = 128;
inline constexpr std::uint32_t kMaxNeighbours = 27 * kMaxInCell;

/// The places of the bodies near a cell, ascending: runs of cells along x, one or (where the grid wraps) two
/// for each of nine rows, without the empty ones.
struct Neighbourhood {
  std::array<Run, 18> runs{};
  std::uint32_t count = 0;
};

/// A grid of cells as wide as the largest diameter. The world is folded onto a power of two of cells per
/// axis, at least four, so that memory follows the number of bodies and not the extent of the world; bodies
/// of cells that fold onto each other fail the distance test. After construction nothing allocates.
class Grid {
 public:
  Grid(const Vec3f& low, const Vec3f& high, float cell_width, std::uint32_t capacity);

  /// Sorts `unsorted` by cell, and within a cell by its order there. Call before the queries.
  void sort(std::span<const Record> unsorted);
  /// The bodies in cells come first, then those whose cell was full.
  [[nodiscard]] std::span<const Record> sorted() const { return {sorted_.data(), size_}; }
  [[nodiscard]] std::uint32_t in_cells() const { return first_.back(); }
  /// Cell of a point within the bounds.
  [[nodiscard]] std::uint32_t cell_of(float x, float y, float z) const {
    return (along(z, 2) << (bits_[0] + bits_[1])) | (along(y, 1) << bits_[0]) | along(x, 0);
  }
  /// With `later_only`, rows before the cell's own are left out, which saves half of the look-ups.
  [[nodiscard]] Neighbourhood neighbourhood(std::uint32_t cell, bool later_only = false) const;

 private:
  [[nodiscard]] std::uint32_t along(float at, std::size_t axis) const {
    return static_cast<std::uint32_t>((at - low_[axis]) * inverse_width_) & ((1U << bits_[axis]) - 1U);
  }

  Vec3f low_{};
  float inverse_width_ = 1;
  std::array<std::uint32_t, 3> bits_{};  ///< log2 of the cells along x, y, z
  std::vector<std::uint32_t> first_;     ///< of each cell, and one past the last
  std::vector<std::uint32_t> cell_;      ///< of each unsorted record
  std::vector<Record> sorted_;
  std::size_t size_ = 0;
};

}  // namespace tandem::engine
