#pragma once
// Threads for work on many bodies.

#include <cstdint>

#include "sdk/core/lattice/run_blocks.hpp"

namespace tandem {

/// Runs blocks on the calling thread and `threads - 1` others, which live as long as the result and its
/// copies. Empty for one thread. Thread-safe: a caller that finds the others at work for another caller does
/// its work alone.
[[nodiscard]] RunBlocks blocks_on_threads(std::uint32_t threads);

}  // namespace tandem
