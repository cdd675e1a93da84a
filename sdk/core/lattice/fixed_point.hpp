#pragma once
// Arithmetic for predicted steps and filters.

#include <algorithm>
#include <bit>
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

/// The square root, rounded down.
[[nodiscard]] constexpr std::uint64_t square_root(std::uint64_t x) {
  if (x == 0) return 0;
  // The start is one Newton step from a power of two, which is at most twice too small. From there the
  // iteration falls until it reaches the root; it needs four steps for 64 bits.
  const unsigned half = (static_cast<unsigned>(std::bit_width(x)) - 1U) / 2U;
  std::uint64_t root = ((x >> half) + (std::uint64_t{1} << half)) / 2 + 1;
  for (std::uint64_t next = (root + x / root) / 2; next < root; next = (root + x / root) / 2) root = next;
  return root;
}

}  // namespace tandem
