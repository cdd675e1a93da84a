#pragma once
// Which bodies of different sizes are near each other: those of neighbouring cells of a torus.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/sleep.hpp"

namespace tandem {

/// Bodies by cell, and of a cell by slot. Allocates at creation only.
class RigidOrder {
 public:
  static constexpr std::uint32_t kMaxInCell = 48;

  explicit RigidOrder(std::uint32_t capacity);

  /// How cells are numbered.
  [[nodiscard]] SleepCells bits() const { return {side_bits_, 2 * side_bits_, 3 * side_bits_}; }
  /// The cells by slot, with all bits set for dead ones. A cell is `width` + 1 times 2^shift lattice units
  /// wide.
  std::span<const std::uint32_t> number(const State& state, std::uint32_t shift, std::int64_t width);
  /// Puts the alive slots in order by the cells of the last number(). The first paired() of them take part in
  /// pairs: of each cell the kMaxInCell lowest; the others follow, by slot. `left_out`: by slot, 1 for
  /// bodies without a place, which are either all bodies of a cell or none; empty if there are none.
  std::span<const Slot> sort(std::span<const std::uint8_t> left_out);
  [[nodiscard]] std::uint32_t paired() const { return paired_; }

  /// Calls visit(from, to) for ranges of places: those of all bodies with which that at `a` makes a pair, in
  /// the order of idl/PROTOCOL.md.
  template <class Visit>
  void each_range(std::uint32_t a, const Visit& visit) const {
    const std::uint32_t row = 1U << side_bits_;
    const std::uint32_t layer = row << side_bits_;
    const std::uint32_t last = (layer << side_bits_) - 1;
    const std::uint32_t cell = cell_of_[a];
    // Cells that follow each other hold places that do, except at the end of the torus.
    const auto in_cells = [&](std::uint32_t from, std::uint32_t first, std::uint32_t end) {
      const std::uint32_t wrapped = end & last;
      if (wrapped >= (first & last)) {
        visit(from, begin_[wrapped + 1]);
        return;
      }
      visit(from, begin_[last + 1]);
      visit(0, begin_[wrapped + 1]);
    };
    in_cells(a + 1, cell, cell + 1);
    for (const std::uint32_t middle : {cell + row, cell + layer - row, cell + layer, cell + layer + row})
      in_cells(begin_[(middle - 1) & last], middle - 1, middle + 1);
  }

 private:
  static constexpr std::uint32_t kNobody = ~std::uint32_t{0};  // the cell of a slot that takes no part

  std::uint32_t side_bits_;
  std::uint32_t paired_ = 0;
  std::vector<std::uint32_t> cell_;     // by slot
  std::vector<std::uint8_t> left_;      // by cell: bodies without a place yet
  std::vector<std::uint32_t> begin_;    // by cell, and one more
  std::vector<std::uint32_t> cell_of_;  // by place
  std::vector<Slot> slots_;             // by place
};

/// The balls around bodies by place, in coarse words: x and y, z and the radius. Coordinates wrap. Behind the
/// last there are as many more as a vector reads.
struct RigidBalls {
  static constexpr int kBits = 13;  // of the distance of two that are near
  static constexpr int kSlack = 8;  // more than what coordinates and radii lose
  static constexpr std::size_t kMore = 8;
  const std::int32_t *xy, *z_radius;
};

/// Writes those of the places from .. to - 1 to `out` whose balls are near that at `a`, or seem to be, in
/// order. Returns how many.
using RigidFindNear = std::size_t (*)(const RigidBalls& balls, std::uint32_t a, std::uint32_t from,
                                      std::uint32_t to, std::uint32_t* out);

}  // namespace tandem
