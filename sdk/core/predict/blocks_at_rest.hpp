#pragma once
// Leaves out of a step the blocks in which all bodies are at rest. Shared by the predictors that can.

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/slot_runs.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// True if a step with this input changes nothing in a block whose bodies are all at rest.
[[nodiscard]] inline bool rest_lasts(const StepInput& input) {
  return input.drive.gravity == input.gravity_before;
}

/// Puts the block as it is in `from` into `to`, unless it is there already. The block is at rest in
/// `from`, and rest_lasts().
inline void keep_block(const State& from, State& to, std::uint32_t block, const StepLedgers& ledgers) {
  TANDEM_ASSERT(ledgers.from.at_rest[block] != 0);
  const std::uint64_t number = ledgers.from.numbers[block];
  if (&from != &to && (number == 0 || number != ledgers.to.numbers[block])) {
    const Slot first = block * kBlockSlots;
    copy_slots(from, to, first, std::min(kBlockSlots, from.capacity() - first));
  }
  ledgers.to.copy(block, ledgers.from);
}

}  // namespace tandem
