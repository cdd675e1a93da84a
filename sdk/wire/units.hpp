#pragma once
// The units of clocks and rates.

#include <cstdint>

namespace tandem {

inline constexpr std::int64_t kMillisecond = 1'000'000;  ///< nanoseconds
inline constexpr std::int64_t kSecond = 1000 * kMillisecond;

/// The thesis's Mbit.
inline constexpr double kBitsPerMbit = 1048576.0;

}  // namespace tandem
