#pragma once
// Chooses how the cells of a world are numbered. The protocol's grid is a cube, rolled up to a torus: a
// flat world covers its own cells many times, and the search looks at bodies that are far apart.

#include <algorithm>
#include <array>
#include <cstdint>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

/// The region of the bodies of a block, in lattice units.
struct CellExtent {
  Vec3i low{INT32_MAX, INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN, INT32_MIN};
  void add(const CellExtent& other);
};

/// How often a world of so many cells along each axis covers a grid, in 1/16 along each axis: at most 2^60,
/// so that three times as much fits, whatever radii are announced.
[[nodiscard]] constexpr std::int64_t times_covered(const std::array<std::int64_t, 3>& cells,
                                                   const ContactCellBits& bits) {
  constexpr std::int64_t kMaxTimes = std::int64_t{1} << 20;
  const std::array<std::uint32_t, 3> sides{bits.row, bits.layer - bits.row, bits.all - bits.layer};
  std::int64_t product = 1;
  for (std::size_t i = 0; i < 3; ++i)
    product *= std::clamp<std::int64_t>((cells[i] << 4U) >> sides[i], 16, kMaxTimes);
  return product;
}

/// Bodies that touch have cells next to each other in any grid, and which of the two is ahead does not depend
/// on the grid either, as long as x comes first in a number and z last. So a grid of other proportions makes
/// the same pairs of bodies that touch, if two conditions hold:
/// 1. The protocol's cells decide which bodies of a cell take part: ContactOrder does that.
/// 2. The search compares places modulo 2^21 grid units. Bodies that are such multiples apart must not be
///    neighbours in either grid: is_safe().
class CellChoice {
 public:
  /// `side_bits`: of the protocol's grid, which has as many cells.
  explicit CellChoice(std::uint32_t side_bits);

  /// The protocol's numbers, or better ones. `shift`, `cells_per`: as ContactOrder::Cells.
  [[nodiscard]] ContactCellBits choose(const CellExtent& extent, std::uint32_t shift, std::int32_t cells_per);
  /// A cell of the chosen grid had too many bodies: for some time the answer is the protocol's.
  void refuse() { refused_ = kRefusedSteps; }
  [[nodiscard]] const ContactCellBits& protocol() const { return protocol_; }

 private:
  static constexpr std::uint32_t kRefusedSteps = 64;
  using Repeats = std::array<std::int64_t, 3>;  // by axis: how many multiples of 2^21 grid units fit

  static bool is_safe(const ContactCellBits& bits, const Repeats& repeats, std::int32_t cells_per);

  ContactCellBits protocol_;
  std::uint32_t refused_ = 0;
  // The last answer of is_safe() for both grids.
  ContactCellBits asked_;
  Repeats asked_repeats_{};
  bool answer_ = false;
};

}  // namespace tandem
