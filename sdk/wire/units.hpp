#pragma once
// The units of clocks and rates.

#include <algorithm>
#include <cstdint>

namespace tandem {

inline constexpr std::int64_t kMillisecond = 1'000'000;  ///< nanoseconds
inline constexpr std::int64_t kSecond = 1000 * kMillisecond;

/// Nominal time between two frames, at least 1 ns and at most some weeks.
[[nodiscard]] constexpr std::int64_t period_ns_of(double frame_rate_hz) {
  return static_cast<std::int64_t>(std::clamp(1e9 / frame_rate_hz, 1.0, 1e15));
}

/// The thesis's Mbit.
inline constexpr double kBitsPerMbit = 1048576.0;

}  // namespace tandem
