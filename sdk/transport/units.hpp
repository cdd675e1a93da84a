#pragma once
// What clocks and rates count in.

#include <cstdint>

namespace tandem {

inline constexpr std::int64_t kMillisecond = 1'000'000;  ///< nanoseconds
inline constexpr std::int64_t kSecond = 1000 * kMillisecond;

/// As in the thesis.
inline constexpr double kBitsPerMbit = 1048576.0;

}  // namespace tandem
