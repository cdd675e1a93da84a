#pragma once
// Threads for work on many bodies.

#include <cstdint>

#include "sdk/core/lattice/run_blocks.hpp"

namespace tandem {

enum class Callers : std::uint8_t {
  kOne,   ///< calls do not overlap, which is asserted
  kMany,  ///< a caller that finds the threads at work for another call does its work alone
};

/// Runs blocks on the calling thread and `threads - 1` others, which live as long as the result and its
/// copies. Empty for one thread.
[[nodiscard]] RunBlocks blocks_on_threads(std::uint32_t threads, Callers callers);

}  // namespace tandem
