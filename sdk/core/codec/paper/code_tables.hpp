#pragma once
// The code tables of `entropy` and `limited`, as they travel in a session.

#include <cstddef>
#include <span>
#include <vector>

#include "sdk/core/codec/paper/huffman.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Computes code lengths from counts of residual bytes (two's complement): 256 for positions, then 256 for
/// velocities; with orientations then 256 for rotation vectors and 256 for angular velocities.
[[nodiscard]] std::vector<std::byte> code_tables(std::span<const SymbolCounts> counts);

/// The tables for a scene that was never trained: lengths for counts that fall with the square of the
/// residual.
[[nodiscard]] std::vector<std::byte> default_code_tables(const Groups& groups = {});

}  // namespace tandem
