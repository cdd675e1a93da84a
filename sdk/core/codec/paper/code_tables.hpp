#pragma once
// The code tables of `entropy` and `limited`, as they travel in a session.

#include <cstddef>
#include <vector>

#include "sdk/core/codec/paper/huffman.hpp"

namespace tandem {

/// Code lengths for counts of residual bytes (two's complement): 256 for positions, then 256 for velocities.
[[nodiscard]] std::vector<std::byte> code_tables(const SymbolCounts& position, const SymbolCounts& velocity);

/// For a scene that was never trained: lengths for counts that fall off with the square of the residual.
[[nodiscard]] std::vector<std::byte> default_code_tables();

}  // namespace tandem
