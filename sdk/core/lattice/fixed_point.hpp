#pragma once
// Arithmetic that predicted steps and filters share.

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
  // From a power of two, at most twice too small, Newton's iteration needs four steps to 64 bits; from then
  // on it falls until it is there.
  const unsigned half = (static_cast<unsigned>(std::bit_width(x)) - 1U) / 2U;
  std::uint64_t root = ((x >> half) + (std::uint64_t{1} << half)) / 2 + 1;
  for (std::uint64_t next = (root + x / root) / 2; next < root; next = (root + x / root) / 2) root = next;
  return root;
}

}  // namespace tandem
