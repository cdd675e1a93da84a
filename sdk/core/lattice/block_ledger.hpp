#pragma once
// Keeps track of which blocks of a state changed, so that blocks in which nothing happens cost nothing. None
// of it is on the wire, and results are the same without it.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// One number for each block of a state. Code that changes a block must give it a number that was not used
/// before, so a block with the same number has the same columns. 0: unknown. In an empty span every block is
/// unknown.
using BlockNumbers = std::span<const std::uint64_t>;

[[nodiscard]] inline std::uint64_t number_of(BlockNumbers numbers, std::uint32_t block) {
  return numbers.empty() ? 0 : numbers[block];
}

/// Kept beside a state by its owner, who sees all changes of it. Two states of one owner with the same number
/// for a block have the same columns in it. Not thread-safe, except that blocks may be renewed side by side.
struct BlockLedger {
  explicit BlockLedger(std::uint32_t capacity)
      : numbers(block_count(capacity)), at_rest(block_count(capacity)) {}

  void renew(std::uint32_t block, std::uint64_t number) {
    numbers[block] = number;
    at_rest[block] = 0;
  }
  void renew_all(std::uint64_t number) {
    std::fill(numbers.begin(), numbers.end(), number);
    std::fill(at_rest.begin(), at_rest.end(), std::uint8_t{0});
  }
  /// Renews the blocks of these slots, which ascend.
  void renew_blocks_of(std::span<const Slot> slots, std::uint64_t number) {
    for (auto slot = slots.begin(); slot != slots.end();) {
      const std::uint32_t block = *slot / kBlockSlots;
      renew(block, number);
      slot = std::lower_bound(slot, slots.end(), (block + 1) * kBlockSlots);
    }
  }
  void copy(std::uint32_t block, const BlockLedger& from) {
    numbers[block] = from.numbers[block];
    at_rest[block] = from.at_rest[block];
  }

  std::vector<std::uint64_t> numbers;
  /// 1: every body of the block is at rest, and stays so as long as gravity is that of the step that led
  /// here.
  std::vector<std::uint8_t> at_rest;
};

}  // namespace tandem
