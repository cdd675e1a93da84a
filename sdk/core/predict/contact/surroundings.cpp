#include "sdk/core/predict/contact/surroundings.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kRegionBits = 6;  // of a cell in a region

}  // namespace

ContactSurroundings::ContactSurroundings(std::uint32_t all_bits, std::uint32_t blocks)
    : near_(((std::size_t{1} << (all_bits - kRegionBits)) + 63) / 64),
      next_to_(blocks > 1 ? (std::size_t{1} << all_bits) / 64 : 0),
      covered_(blocks > 1 ? blocks * near_.size() : 0),
      numbers_(blocks) {}

void ContactSurroundings::begin(const ContactCellBits& bits, bool by_cell) {
  TANDEM_ASSERT(bits.row >= 2 && bits.layer >= bits.row + 2 && bits.all >= bits.layer + 2);
  TANDEM_ASSERT(std::size_t{1} << bits.all <= near_.size() * 64 << kRegionBits);
  if (bits != bits_) std::fill(numbers_.begin(), numbers_.end(), 0U);
  bits_ = bits;
  std::fill(near_.begin(), near_.end(), 0U);
  if (by_cell) std::fill(next_to_.begin(), next_to_.end(), 0U);
}

std::uint32_t ContactSurroundings::region_of(std::uint32_t cell) const {
  const std::uint32_t row = bits_.row, layer = bits_.layer;
  const std::uint32_t x = cell & ((1U << row) - 1);
  const std::uint32_t y = (cell >> row) & ((1U << (layer - row)) - 1);
  const std::uint32_t z = cell >> layer;
  return x >> 2U | y >> 2U << (row - 2) | z >> 2U << (layer - 4);
}

// The regions of the 27 cells around a cell are those of their eight corners.
void ContactSurroundings::add(std::uint32_t cell) {
  const std::uint32_t row = 1U << bits_.row;
  const std::uint32_t layer = 1U << bits_.layer;
  const std::uint32_t last = (1U << bits_.all) - 1;
  const auto mark = [&](std::uint32_t corner) {
    const std::uint32_t region = region_of(corner & last);
    near_[region / 64] |= std::uint64_t{1} << (region % 64);
  };
  for (const std::uint32_t middle :
       {cell - layer - row, cell - layer + row, cell + layer - row, cell + layer + row}) {
    mark(middle - 1);
    mark(middle + 1);
  }
}

void ContactSurroundings::add_cells(std::uint32_t cell) {
  const std::uint32_t last = (1U << bits_.all) - 1;
  const auto mark = [&](std::uint32_t first, std::uint64_t bits) {
    next_to_[(first & last) / 64] |= bits << (first % 64);
  };
  for (const std::uint32_t z : {0U - (1U << bits_.layer), 0U, 1U << bits_.layer}) {
    for (const std::uint32_t y : {0U - (1U << bits_.row), 0U, 1U << bits_.row}) {
      const std::uint32_t first = cell + y + z - 1;  // of three cells in a row
      if (first % 64 < 62) {
        mark(first, 7);
      } else {
        for (std::uint32_t x = 0; x < 3; ++x) mark(first + x, 1);
      }
    }
  }
}

bool ContactSurroundings::knows(std::uint32_t block, std::uint64_t number) const {
  return number != 0 && numbers_[block] == number;
}

void ContactSurroundings::learn(std::uint32_t block, std::uint64_t number,
                                std::span<const std::uint32_t> cells) {
  TANDEM_ASSERT((std::size_t{block} + 1) * near_.size() <= covered_.size());
  const auto own = std::span(covered_).subspan(block * near_.size(), near_.size());
  std::fill(own.begin(), own.end(), 0U);
  for (const std::uint32_t cell : cells) {
    if (cell >> bits_.all != 0) continue;
    const std::uint32_t region = region_of(cell);
    own[region / 64] |= std::uint64_t{1} << (region % 64);
  }
  numbers_[block] = number;
}

bool ContactSurroundings::meets(std::uint32_t block) const {
  const std::uint64_t* const own = &covered_[block * near_.size()];
  std::uint64_t common = 0;
  for (std::size_t i = 0; i < near_.size(); ++i) common |= own[i] & near_[i];
  return common != 0;
}

}  // namespace tandem
