#pragma once
// The walk over the grid's bodies, for each way to look at a run of them.

#include <cstdint>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

/// Runs of bodies that follow each other, to look at one after another.
/// `Build` is a type of an unnamed namespace: code for AVX2 must not become everybody's.
template <class Build>
class ContactRuns {
 public:
  static constexpr std::uint32_t kBodies = 32;  ///< whose runs fit

  /// Bodies near `self` may be among 1 to 48. In 64 bits, for they are many: 32 bits of the place of the
  /// first, 6 bits how many, and the one.
  class Run {
   public:
    Run() = default;
    Run(std::uint32_t self, std::uint32_t from, std::uint32_t count)
        : bits_(std::uint64_t{self} << 38U | std::uint64_t{count} << 32U | from) {}
    [[nodiscard]] std::uint32_t self() const { return static_cast<std::uint32_t>(bits_ >> 38U); }
    [[nodiscard]] std::uint32_t from() const { return static_cast<std::uint32_t>(bits_); }
    [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(bits_ >> 32U) & 63U; }

   private:
    std::uint64_t bits_ = 0;
  };

  void clear() { count_ = 0; }
  [[nodiscard]] std::uint32_t size() const { return count_; }
  [[nodiscard]] const Run& operator[](std::uint32_t i) const { return runs_[i]; }

  /// Of one body: its own cell and the 13 ahead.
  void add_body(const ContactGrid& grid, std::uint32_t place) {
    const std::uint32_t* const begin = grid.begin;
    const std::uint32_t side = grid.side_bits;
    const std::uint32_t last = (1U << (3 * side)) - 1;
    const std::uint32_t cell = grid.cell[place];
    const std::uint32_t row = 1U << side;
    const std::uint32_t layer = row << side;
    if (cell != last) {
      add(place, place + 1, begin[cell + 2]);
    } else {
      add(place, place + 1, begin[cell + 1]);
      add(place, 0, begin[1]);
    }
    add_three(begin, last, place, (cell + row) & last);
    add_three(begin, last, place, (cell + layer - row) & last);
    add_three(begin, last, place, (cell + layer) & last);
    add_three(begin, last, place, (cell + layer + row) & last);
  }

 private:
  // No branch: whether there are any is as good as random.
  void add(std::uint32_t self, std::uint32_t from, std::uint32_t to) {
    runs_[count_] = Run(self, from, to - from);
    count_ += static_cast<std::uint32_t>(from != to);
  }
  // A cell and those before and behind it.
  void add_three(const std::uint32_t* begin, std::uint32_t last, std::uint32_t self, std::uint32_t cell) {
    if (cell - 1 < last - 1) return add(self, begin[cell - 1], begin[cell + 2]);
    add(self, begin[cell == 0 ? 0 : last - 1], begin[cell == 0 ? 2 : last + 1]);
    add(self, begin[cell == 0 ? last : 0], begin[cell == 0 ? last + 1 : 1]);
  }

  std::uint32_t count_ = 0;
  Run runs_[kBodies * 10 + 1] = {};
};

/// ContactKernels::find. `Build::collect(grid, runs, pairs)` adds the pairs of all runs.
template <class Build>
std::uint32_t find_pairs(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough,
                         ContactPairs& pairs) {
  using Runs = ContactRuns<Build>;
  static_assert(Runs::kBodies * 14 * ContactGrid::kMostInCell + 16 <= ContactPairs::kMostAtOnce);
  const std::uint32_t end = grid.begin[std::uint32_t{1} << (3 * grid.side_bits)];
  Runs runs;
  pairs.count = 0;
  while (place < end && pairs.count < enough) {
    const std::uint32_t stop = end - place < Runs::kBodies ? end : place + Runs::kBodies;
    runs.clear();
    for (; place < stop; ++place) runs.add_body(grid, place);
    Build::collect(grid, runs, pairs);
  }
  for (; pairs.count % 8 != 0; ++pairs.count) pairs.first[pairs.count] = pairs.second[pairs.count] = 0;
  return place;
}

}  // namespace tandem
