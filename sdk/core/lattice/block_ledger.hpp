#pragma once
// Keeps track of which blocks of a state changed, and which runs of slots in them, so that what does not
// happen costs nothing. None of it is on the wire, and results are the same without it.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// One number for each block of a state. Code that changes a block must give it a number that was not used
/// before, so a block with the same number has the same columns. 0: unknown. In an empty span every block is
/// unknown.
using BlockNumbers = std::span<const std::uint64_t>;

[[nodiscard]] inline std::uint64_t number_of(BlockNumbers numbers, std::uint32_t block) {
  TANDEM_ASSERT(numbers.empty() || block < numbers.size());
  return numbers.empty() ? 0 : numbers[block];
}

/// Kept beside a state by its owner, who sees all changes of it. Two states of one owner with the same number
/// for a block have the same columns in it. Not thread-safe, except that blocks may be renewed side by side.
struct BlockLedger {
  static constexpr std::uint32_t kRunSlots = 64;
  static constexpr std::uint32_t kRuns = kBlockSlots / kRunSlots;  ///< in a block

  explicit BlockLedger(std::uint32_t capacity)
      : numbers(block_count(capacity)),
        at_rest(block_count(capacity)),
        runs((capacity + kRunSlots - 1) / kRunSlots) {}

  void renew(std::uint32_t block, std::uint64_t number) {
    TANDEM_ASSERT(number != 0 && number != numbers[block]);
    numbers[block] = number;
    at_rest[block] = 0;
    const std::span own = runs_of(block);
    std::fill(own.begin(), own.end(), number);
  }
  void renew_all(std::uint64_t number) {
    numbers.assign(numbers.size(), number);
    at_rest.assign(at_rest.size(), 0);
    runs.assign(runs.size(), number);
  }
  /// Renews the blocks of these slots, which ascend, and in them the runs of these slots alone.
  void renew_blocks_of(std::span<const Slot> slots, std::uint64_t number) {
    TANDEM_ASSERT(std::is_sorted(slots.begin(), slots.end()));
    for (auto slot = slots.begin(); slot != slots.end();) {
      const std::uint32_t run = *slot / kRunSlots;
      numbers[run / kRuns] = number;
      at_rest[run / kRuns] = 0;
      runs[run] = number;
      while (slot != slots.end() && *slot / kRunSlots == run) ++slot;
    }
  }
  void copy(std::uint32_t block, const BlockLedger& from) {
    TANDEM_ASSERT(runs.size() == from.runs.size());
    numbers[block] = from.numbers[block];
    at_rest[block] = from.at_rest[block];
    if (this == &from) return;
    const auto others = std::span(from.runs).subspan(first_run(block), runs_of(block).size());
    std::copy(others.begin(), others.end(), runs_of(block).begin());
  }
  [[nodiscard]] std::span<std::uint64_t> runs_of(std::uint32_t block) {
    const std::size_t first = first_run(block);
    return std::span(runs).subspan(first, std::min<std::size_t>(kRuns, runs.size() - first));
  }
  [[nodiscard]] static std::size_t first_run(std::uint32_t block) { return std::size_t{block} * kRuns; }

  std::vector<std::uint64_t> numbers;
  /// 1: every body of the block is at rest, and stays so as long as gravity is that of the step that led
  /// here.
  std::vector<std::uint8_t> at_rest;
  /// Numbers as those of blocks, by runs of kRunSlots slots. A block that is renewed may keep some of them.
  std::vector<std::uint64_t> runs;
};

}  // namespace tandem
