#include "services/engine/particles/grid.hpp"

#include <algorithm>

namespace tandem::engine {
namespace {

constexpr std::uint32_t kMinBits = 2;  // neighbours on both sides must be different cells
constexpr std::uint32_t kMaxBits = 10;
// More makes clearing the table cost more than the folded cells save.
constexpr std::uint32_t kCellsPerBody = 4;

constexpr std::uint32_t kNoCell = UINT32_MAX;

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
  cell_.resize(capacity);
  sorted_.resize(capacity);
}

void Grid::sort(std::span<const Record> unsorted) {
  size_ = unsorted.size();
  std::fill(first_.begin(), first_.end(), 0U);
  for (std::size_t i = 0; i < size_; ++i) {
    cell_[i] = cell_of(unsorted[i].x, unsorted[i].y, unsorted[i].z);
    if (++first_[cell_[i]] <= kMaxInCell) continue;
    --first_[cell_[i]];
    cell_[i] = kNoCell;
  }
  // Counting sort: turn counts into ends, then fill each cell from its end; first_ is left at the beginnings.
  std::uint32_t end = 0;
  for (std::uint32_t& entry : first_) {
    end += entry;
    entry = end;
  }
  auto overflow = static_cast<std::uint32_t>(size_);
  for (std::size_t i = size_; i-- > 0;) {
    const std::uint32_t place = cell_[i] == kNoCell ? --overflow : --first_[cell_[i]];
    sorted_[place] = unsorted[i];
  }
}

Neighbourhood Grid::neighbourhood(std::uint32_t cell, bool later_only) const {
  const std::array<std::uint32_t, 3> mask{(1U << bits_[0]) - 1U, (1U << bits_[1]) - 1U,
                                          (1U << bits_[2]) - 1U};
  const std::uint32_t x = cell & mask[0];
  const std::uint32_t y = (cell >> bits_[0]) & mask[1];
  const std::uint32_t z = cell >> (bits_[0] + bits_[1]);
  Neighbourhood result;
  const auto add = [&](std::uint32_t row, std::uint32_t from, std::uint32_t to) {
    const Run run{first_[row + from], first_[row + to + 1]};
    if (run.begin == run.end) return;
    std::uint32_t at = result.count++;
    for (; at > 0 && result.runs[at - 1].begin > run.begin; --at) result.runs[at] = result.runs[at - 1];
    result.runs[at] = run;
  };
  for (std::uint32_t dz = 0; dz < 3; ++dz) {
    for (std::uint32_t dy = 0; dy < 3; ++dy) {
      const std::uint32_t row =
          (((z + dz - 1U) & mask[2]) << (bits_[0] + bits_[1])) | (((y + dy - 1U) & mask[1]) << bits_[0]);
      if (later_only && row < cell - x) continue;
      if (x == 0) {
        add(row, 0, 1);
        add(row, mask[0], mask[0]);
      } else if (x == mask[0]) {
        add(row, x - 1, x);
        add(row, 0, 0);
      } else {
        add(row, x - 1, x + 1);
      }
    }
  }
  return result;
}

}  // namespace tandem::engine
