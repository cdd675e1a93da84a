#pragma once
// The walk over the grid's bodies, for each way to examine a run of them.

#include <array>
#include <cstdint>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

/// Visits a cell and the 13 cells ahead of it, as runs of consecutive bodies: three cells of a row are one
/// run. Runs are neither listed first nor skipped if empty, because whether one is empty is hard to predict,
/// and most are not.
template <class Search>
class ContactWalk {
 public:
  explicit ContactWalk(const ContactGrid& grid)
      : begin_(grid.begin),
        row_(1U << grid.bits.row),
        layer_(1U << grid.bits.layer),
        last_((1U << grid.bits.all) - 1) {}

  /// Visits the neighbours of the body at `place` in `cell`.
  void around(std::uint32_t place, std::uint32_t cell, Search& search) const {
    const std::array<std::uint32_t, 4> middles = middles_of(cell);
    bool inside = cell != last_;
    for (const std::uint32_t middle : middles) inside &= middle - 1 < last_ - 1;
    if (!inside) {
      search = around_the_ends(place, cell, search);
      return;
    }
    search.among(place + 1, begin_[cell + 2]);
    for (const std::uint32_t middle : middles) search.among(begin_[middle - 1], begin_[middle + 2]);
  }

 private:
  [[nodiscard]] std::array<std::uint32_t, 4> middles_of(std::uint32_t cell) const {
    return {(cell + row_) & last_, (cell + layer_ - row_) & last_, (cell + layer_) & last_,
            (cell + layer_ + row_) & last_};
  }
  // At the ends, where the list of cells closes to a ring, a run may be split in two. `search` is copied, so
  // that the caller's stays in registers.
  [[gnu::noinline]] Search around_the_ends(std::uint32_t place, std::uint32_t cell, Search search) const {
    search.among(place + 1, begin_[cell + 1]);
    among_cell(cell + 1, search);
    for (const std::uint32_t middle : middles_of(cell)) {
      for (const std::uint32_t of : {middle - 1, middle, middle + 1}) among_cell(of, search);
    }
    return search;
  }
  [[gnu::noinline]] void among_cell(std::uint32_t cell, Search& search) const {
    search.among(begin_[cell & last_], begin_[(cell & last_) + 1]);
  }

  const std::uint32_t* begin_;
  std::uint32_t row_, layer_, last_;
};

/// Implements ContactKernels::find. `Search` is in an unnamed namespace, because code for AVX2 must not be
/// linked into other code. It has start(place), the body whose neighbours are searched; among(from, to),
/// which adds the neighbours of a run of at most 48 bodies; and count(), the number of pairs.
template <class Search>
std::uint32_t find_pairs(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough,
                         ContactPairs& pairs) {
  static_assert(14 * ContactGrid::kMaxInCell + 16 <= ContactPairs::kMaxAtOnce);
  std::uint32_t end = grid.begin[std::uint32_t{1} << grid.bits.all];
  if (grid.end < end) end = grid.end;
  Search search(grid, pairs);
  const ContactWalk<Search> walk(grid);
  for (; place < end && search.count() < enough; ++place) {
    search.start(place);
    walk.around(place, grid.cell[place], search);
  }
  pairs.count = search.count();
  return place;
}

}  // namespace tandem
