#pragma once
// Which bodies of different sizes are near each other: those of neighbouring cells of a torus.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Bodies by cell, and of a cell by slot. Allocates at creation only.
class RigidOrder {
 public:
  static constexpr std::uint32_t kMostInCell = 48;

  explicit RigidOrder(std::uint32_t capacity);

  /// Puts the alive slots in order. The first paired() of them take part in pairs: of each cell the
  /// kMostInCell lowest; the others follow, by slot. A cell is `width` + 1 times 2^shift lattice units wide.
  std::span<const Slot> sort(const State& state, std::uint32_t shift, std::int64_t width);
  [[nodiscard]] std::uint32_t paired() const { return paired_; }

  /// Calls visit(a, b) with places of all pairs of bodies in the same or neighbouring cells, in the order of
  /// idl/PROTOCOL.md.
  template <class Visit>
  void each_pair(const Visit& visit) const {
    const std::uint32_t row = 1U << side_bits_;
    const std::uint32_t layer = row << side_bits_;
    const std::uint32_t last = (layer << side_bits_) - 1;
    for (std::uint32_t a = 0; a < paired_; ++a) {
      const std::uint32_t cell = cell_of_[a];
      const auto among = [&](std::uint32_t from, std::uint32_t to) {
        for (std::uint32_t b = from; b < to; ++b) visit(a, b);
      };
      const auto in_cell = [&](std::uint32_t of) { among(begin_[of & last], begin_[(of & last) + 1]); };
      among(a + 1, begin_[cell + 1]);
      in_cell(cell + 1);
      for (const std::uint32_t middle : {cell + row, cell + layer - row, cell + layer, cell + layer + row}) {
        for (const std::uint32_t of : {middle - 1, middle, middle + 1}) in_cell(of);
      }
    }
  }

 private:
  std::uint32_t side_bits_;
  std::uint32_t paired_ = 0;
  std::vector<std::uint32_t> cell_;     // by slot
  std::vector<std::uint8_t> left_;      // by cell: bodies without a place yet
  std::vector<std::uint32_t> begin_;    // by cell, and one more
  std::vector<std::uint32_t> cell_of_;  // by place
  std::vector<Slot> slots_;             // by place
};

}  // namespace tandem
