#pragma once
// What is known about the blocks of a state without reading their columns, so that blocks in which nothing
// happens cost nothing. Nothing here is on the wire, and results are the same without it.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// The numbers of the contents of a state's blocks. Whoever changes a block gives it a number that was not in
/// use; so a reader that sees the number it saw before knows that the columns are the same too. 0: unknown,
/// as is every block of an empty span.
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
