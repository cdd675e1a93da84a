#pragma once
// The bodies that got a new anchor since all were sorted, found by cell.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/engines/particles/grid.hpp"
#include "services/engines/particles/kernels.hpp"

namespace tandem::engine {

/// They are kept in the order in which they came, and arranged anew, by cell, whenever some have changed: so
/// a search reads them side by side, like those that were sorted. After construction nothing allocates. Not
/// thread-safe; a search alone may be made by several threads.
class Strays {
 public:
  struct Stray {
    float x, y, z, radius;
    std::uint32_t place, cell;
  };
  /// Some of the runs that look_around() finds are not a cell's alone.
  struct Runs {
    std::array<Run, 27> runs;
    std::uint32_t count = 0;
  };

  explicit Strays(std::uint32_t most);

  void clear();
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(strays_.size()); }
  [[nodiscard]] bool full() const { return strays_.size() == strays_.capacity(); }
  /// Returns its number. Not when full().
  std::uint32_t add(const Stray& stray);
  [[nodiscard]] Stray& operator[](std::uint32_t number) { return strays_[number]; }
  /// The last one gets the number of the one that is removed. Returns the place of the last one.
  std::uint32_t remove(std::uint32_t number);

  /// What follows finds those that there were in the last call of this.
  void arrange();
  /// Runs of at least all that are in the cells around the one that is `across[1]` into the row `rows.of`;
  /// none twice.
  void look_around(const Rows& rows, const std::array<std::uint32_t, 3>& across, Runs& out) const;
  [[nodiscard]] Anchors anchors() const {
    return {x_.data(), y_.data(), z_.data(), radius_.data(), place_.data()};
  }

 private:
  // Cells that are neighbours along x are mostly neighbours in the table. Bodies fill few of the other bits
  // of a cell's number, such as those of height, so these are spread.
  static constexpr std::uint32_t kTogether = 64;
  [[nodiscard]] std::uint32_t bucket(std::uint32_t cell) const {
    return (cell / kTogether * 0x9E3779B1U & mask_) + cell % kTogether;
  }

  std::vector<Stray> strays_;
  std::uint32_t mask_ = 0;  ///< of the numbers of buckets, without the bits of cells that are together
  std::vector<std::uint32_t> first_;  ///< by bucket: its first in the columns; and one past the last
  std::vector<float> x_, y_, z_, radius_;
  std::vector<std::uint32_t> place_;
};

}  // namespace tandem::engine
