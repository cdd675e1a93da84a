#pragma once
// Uniform cells (thesis, section 3.2.1; S. Green 2008): bodies sorted so that those of a cell, and of cells
// that are neighbours along x, lie next to each other.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/workers/workers.hpp"
#include "services/engines/common/world.hpp"

namespace tandem::engine {

/// Places [begin, end).
struct Run {
  std::uint32_t begin = 0, end = 0;
};

/// Maximum number of bodies of a cell that take part in contacts, which bounds a step if all bodies are in
/// one place. The other bodies of the cell meet no body. A cell holds 16 equal spheres that are squeezed to
/// half their diameter.
inline constexpr std::uint32_t kMaxInCell = 128;
inline constexpr std::uint32_t kMaxNeighbours = 27 * kMaxInCell;

inline constexpr std::uint32_t kNoCell = UINT32_MAX;        ///< of a place without a body
inline constexpr std::uint32_t kNoPlace = UINT32_MAX;       ///< of a body that has none
inline constexpr std::uint32_t kFullCell = UINT32_MAX - 1;  ///< of a body whose cell was full

/// The places of the bodies near a cell, ascending: runs of cells along x, one or (where the grid wraps) two
/// for each of nine rows. Runs may be empty.
struct Neighbourhood {
  std::array<Run, 18> runs{};
  std::uint32_t count = 0;
};

/// The first cells of the nine rows around those of a row, ascending.
struct Rows {
  std::array<std::uint32_t, 9> first{};
  std::uint32_t of = kNoCell;  ///< the row's first cell
};

/// A grid of cells at least as wide as bodies reach. The world is folded onto a power of two of cells per
/// axis, at least four, so that memory follows the number of bodies and not the extent of the world; bodies
/// of cells that fold onto each other fail the distance test. After construction nothing allocates.
class Grid {
 public:
  Grid(const Vec3f& low, const Vec3f& high, float cell_width, std::uint32_t capacity);

  /// Gives bodies places by cell, and within a cell by their order here. `cells`: cell_of() of each body, or
  /// kNoCell where there is none; becomes kFullCell for those that a full cell turns away. `places` gets the
  /// place of each body: those in cells come first, then those turned away; kNoPlace where there is none.
  void arrange(std::span<std::uint32_t> cells, std::span<std::uint32_t> places, Workers& workers,
               std::uint32_t slices);
  /// Takes over an order that arrange() made: `cells` by place, ascending, with kNoCell for places that do
  /// not count. Returns false if they do not ascend.
  [[nodiscard]] bool adopt_order(std::span<const std::uint32_t> cells);
  [[nodiscard]] std::uint32_t in_cells() const { return in_cells_; }
  /// In cells and turned away.
  [[nodiscard]] std::uint32_t size() const { return size_; }

  /// Cell of a point; near points have the same or neighbouring cells.
  [[nodiscard]] std::uint32_t cell_of(float x, float y, float z) const {
    return (along(z, 2) << (bits_[0] + bits_[1])) | (along(y, 1) << bits_[0]) | along(x, 0);
  }
  /// `rows` is kept from call to call: neighbouring cells mostly share it.
  void look_around(std::uint32_t cell, Rows& rows, Neighbourhood& out) const;
  /// How far into its row a cell is, and those on both sides of it are; the one on the left comes first.
  [[nodiscard]] std::array<std::uint32_t, 3> across(std::uint32_t cell) const {
    const std::uint32_t mask = (1U << bits_[0]) - 1U, x = cell & mask;
    return {(x - 1U) & mask, x, (x + 1U) & mask};
  }
  [[nodiscard]] std::uint32_t cells() const { return static_cast<std::uint32_t>(first_.size() - 1); }

 private:
  [[nodiscard]] std::uint32_t along(float at, std::size_t axis) const {
    // Points below the bounds lie in the first cells. Those above them fold like others.
    const float cells = (at - low_[axis]) * inverse_width_;
    return static_cast<std::uint32_t>(cells > 0 ? cells : 0) & ((1U << bits_[axis]) - 1U);
  }

  Vec3f low_{};
  float inverse_width_ = 1;
  std::array<std::uint32_t, 3> bits_{};  ///< log2 of the cells along x, y, z
  std::vector<std::uint32_t> first_;     ///< place of each cell, and one past the last
  std::uint32_t in_cells_ = 0, size_ = 0;
};

}  // namespace tandem::engine
