#pragma once
// The bodies that got a new anchor since all were sorted, found by cell.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "services/engine/particles/grid.hpp"

namespace tandem::engine {

/// A hash table of chains. What a search reads of a body lies side by side. After construction nothing
/// allocates. Not thread-safe; for_each() alone may be called from several threads.
class Strays {
 public:
  struct Stray {
    float x, y, z, radius;
    std::uint32_t place, cell, next;
  };

  explicit Strays(std::uint32_t most) : heads_(std::bit_ceil(std::size_t{most} + 1), kNone) {
    strays_.reserve(most);
  }

  void clear();
  [[nodiscard]] bool full() const { return free_ == kNone && strays_.size() == strays_.capacity(); }
  /// Must not be called when full(). `stray.next` is ignored.
  void add(const Stray& stray);
  /// The body of `place`, which was added with `cell`.
  void remove(std::uint32_t cell, std::uint32_t place);

  /// Calls visit(stray) for those of a cell.
  template <class Visit>
  void for_each(std::uint32_t cell, const Visit& visit) const {
    for (std::uint32_t i = heads_[bucket(cell)]; i != kNone; i = strays_[i].next)
      if (strays_[i].cell == cell) visit(strays_[i]);
  }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  // Cells that are neighbours along x are neighbours in the table. Bodies fill few of the other bits of a
  // cell's number, such as those of height, so these are spread.
  [[nodiscard]] std::size_t bucket(std::uint32_t cell) const {
    constexpr std::uint32_t kTogether = 64;
    return (cell / kTogether * 0x9E3779B1U + cell % kTogether) & (heads_.size() - 1);
  }

  std::vector<std::uint32_t> heads_;
  std::vector<Stray> strays_;
  std::uint32_t free_ = kNone;  ///< first of a chain of entries that were removed
};

}  // namespace tandem::engine
