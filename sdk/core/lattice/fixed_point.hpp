#pragma once
// Arithmetic that predicted steps and filters share.

#include <algorithm>
#include <cstdint>

namespace tandem {

/// (x * share) / 65536, rounded half up; the product must fit.
[[nodiscard]] constexpr std::int64_t share_of(std::int64_t x, std::int64_t share) {
  return (x * share + 32768) >> 16;
}

/// `value` within +-limit, which fits 32 bits.
[[nodiscard]] constexpr std::int32_t limited(std::int64_t value, std::int64_t limit) {
  return static_cast<std::int32_t>(std::clamp(value, -limit, limit));
}

}  // namespace tandem
