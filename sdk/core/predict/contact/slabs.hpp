#pragma once
// Cuts the grid into slabs whose pairs can be worked on side by side.

#include <array>
#include <cstdint>
#include <span>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

/// The places of some consecutive layers of cells.
struct ContactSlab {
  std::uint32_t first = 0, end = 0;
};

/// Pairs lead from a body to bodies of its layer, of the next one, and, from its last row, of the one after
/// that; the last layer is followed by the first. A slab has at least two layers. So the pairs of a slab
/// change bodies of this slab and of the next one alone: slabs of even number can be worked on at the same
/// time, and those of odd number after them.
class ContactSlabs {
 public:
  /// `begin`: by cell, and one more, as in ContactGrid.
  void cut(std::span<const std::uint32_t> begin, const ContactCellBits& bits);

  /// One slab, or an even number of them.
  [[nodiscard]] std::span<const ContactSlab> all() const { return std::span(slabs_).first(count_); }

  static constexpr std::uint32_t kMaxSlabs = 64;

 private:
  std::array<ContactSlab, kMaxSlabs> slabs_;
  std::uint32_t count_ = 0;
};

}  // namespace tandem
