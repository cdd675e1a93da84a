#pragma once
// Threads for the codec's blocks.

#include <cstdint>

#include "sdk/core/codec/codec.hpp"

namespace tandem::host {

/// Runs blocks on the calling thread and `threads - 1` others, which live as long as the result and its
/// copies. Empty for one thread. Calls must not overlap.
[[nodiscard]] RunBlocks blocks_on_threads(std::uint32_t threads);

}  // namespace tandem::host
