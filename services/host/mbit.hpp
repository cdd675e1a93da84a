#pragma once

namespace tandem {

/// Bits of a Mbit, as in the thesis.
inline constexpr double kBitsPerMbit = 1048576.0;

}  // namespace tandem
