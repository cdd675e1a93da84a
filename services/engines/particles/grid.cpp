#include "services/engines/particles/grid.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::engine {
namespace {

constexpr std::uint32_t kMinBits = 2;  // neighbours on both sides must be different cells
constexpr std::uint32_t kMaxBits = 10;
// More makes clearing the table cost more than the folded cells save.
constexpr std::uint32_t kCellsPerBody = 4;

}  // namespace

Grid::Grid(const Vec3f& low, const Vec3f& high, float cell_width, std::uint32_t capacity)
    : low_(low), inverse_width_(1.0F / cell_width) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float cells = (high[axis] - low[axis]) * inverse_width_;
    bits_[axis] = kMinBits;
    while (bits_[axis] < kMaxBits && static_cast<float>(1U << bits_[axis]) < cells) ++bits_[axis];
  }
  const auto total = [this] { return std::uint64_t{1} << (bits_[0] + bits_[1] + bits_[2]); };
  while (total() > std::max<std::uint64_t>(64, std::uint64_t{capacity} * kCellsPerBody)) {
    --*std::max_element(bits_.begin(), bits_.end());
  }
  first_.resize(total() + 1);
}

// A counting sort. Each slice of the cells is one thread's: it looks at all bodies and counts its own.
void Grid::arrange(std::span<std::uint32_t> cells, std::span<std::uint32_t> places, Workers& workers,
                   std::uint32_t slices) {
  TANDEM_ASSERT(1 <= slices && slices <= kMaxThreads && cells.size() == places.size());
  const auto total = static_cast<std::uint32_t>(first_.size() - 1);
  const std::uint32_t slice = (total + slices - 1) / slices;
  constexpr std::uint32_t kMaxSlices = kMaxThreads;
  std::array<std::uint32_t, kMaxSlices + 1> bodies{}, turned_away{};
  std::uint32_t* const next =
      first_.data() + 1;  // counts, then places; at last the ends, which are beginnings
  first_[0] = 0;
  workers.run(total, slice, [&](std::uint32_t begin, std::uint32_t end) {
    std::fill(next + begin, next + end, 0U);
    std::uint32_t in = 0, away = 0;
    for (std::uint32_t& cell : cells) {
      if (cell - begin >= end - begin) continue;
      if (next[cell] == kMaxInCell) {
        cell = kFullCell;
        ++away;
      } else {
        ++next[cell];
        ++in;
      }
    }
    bodies[begin / slice] = in;
    turned_away[begin / slice] = away;
  });
  in_cells_ = 0;
  std::uint32_t away = 0;
  for (std::uint32_t i = 0; i < slices; ++i) {
    in_cells_ += std::exchange(bodies[i], in_cells_);
    away += turned_away[i];
  }
  size_ = in_cells_ + away;
  TANDEM_ASSERT(size_ <= cells.size());
  workers.run(total, slice, [&](std::uint32_t begin, std::uint32_t end) {
    std::uint32_t at = bodies[begin / slice];
    for (std::uint32_t cell = begin; cell < end; ++cell) at += std::exchange(next[cell], at);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (cells[i] - begin < end - begin) places[i] = next[cells[i]]++;
    }
  });
  std::uint32_t last = in_cells_;
  for (std::size_t i = 0; i < cells.size() && (away > 0 || size_ < cells.size()); ++i) {
    if (cells[i] == kFullCell) places[i] = last++;
    if (cells[i] == kNoCell) places[i] = kNoPlace;
  }
}

bool Grid::adopt_order(std::span<const std::uint32_t> cells) {
  size_ = static_cast<std::uint32_t>(cells.size());
  in_cells_ = 0;
  std::uint32_t next = 1;  // the first cell whose beginning is not known
  first_[0] = 0;
  for (std::uint32_t place = 0; place < size_; ++place) {
    const bool counts = cells[place] != kNoCell;
    if (counts) {
      if (cells[place] + 1 < next || cells[place] >= this->cells()) return false;
      for (; next <= cells[place]; ++next) first_[next] = place;
      in_cells_ = place + 1;
    }
    if (place - first_[next - 1] < kMaxInCell) continue;
    // The cell is full. Where a place that does not count was is not known: it goes to the next cell.
    if (counts) return false;
    if (next < this->cells()) first_[next++] = place;
  }
  // Places behind the last that counts are in no cell, and fill none.
  for (; next > 0 && first_[next - 1] > in_cells_; --next) continue;
  for (; next < first_.size(); ++next) first_[next] = in_cells_;
  return true;
}

void Grid::look_around(std::uint32_t cell, Rows& rows, Neighbourhood& out) const {
  const std::array<std::uint32_t, 3> mask{(1U << bits_[0]) - 1U, (1U << bits_[1]) - 1U,
                                          (1U << bits_[2]) - 1U};
  const std::uint32_t x = cell & mask[0];
  if (cell - x != rows.of) {
    rows.of = cell - x;
    const std::uint32_t y = (cell >> bits_[0]) & mask[1], z = cell >> (bits_[0] + bits_[1]);
    for (std::uint32_t i = 0; i < 9; ++i) {
      rows.first[i] = (((z + i / 3 - 1U) & mask[2]) << (bits_[0] + bits_[1])) |
                      (((y + i % 3 - 1U) & mask[1]) << bits_[0]);
    }
    std::sort(rows.first.begin(), rows.first.end());
  }
  if (x > 0 && x < mask[0]) {
    out.count = 9;
    for (std::size_t i = 0; i < 9; ++i) {
      const std::uint32_t* const near = &first_[rows.first[i] + x - 1];
      out.runs[i] = {near[0], near[3]};
    }
    return;
  }
  const std::uint32_t low = x == 0 ? 0 : x - 1, high = x == 0 ? 1 : x;
  out.count = 0;
  for (const std::uint32_t row : rows.first) {
    const Run near{first_[row + low], first_[row + high + 1]};
    const std::uint32_t other = x == 0 ? row + mask[0] : row;  // the cell at the other end of the row
    const Run far{first_[other], first_[other + 1]};
    out.runs[out.count++] = x == 0 ? near : far;
    out.runs[out.count++] = x == 0 ? far : near;
  }
}

}  // namespace tandem::engine
