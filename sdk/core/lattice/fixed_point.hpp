#pragma once
// Arithmetic for predicted steps and filters.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
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

/// 2^15 / root(x) for x from 1/4 to 1, in 256ths.
inline constexpr std::array<std::uint16_t, 256> kInverseRoots = [] {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t i = 64; i < table.size(); ++i)
    table[i] = static_cast<std::uint16_t>(square_root((std::uint64_t{1} << 39U) / (2 * i + 1)));
  return table;
}();

/// square_root() for 0 < x < 2^56, several times faster: two steps of Newton for 1 / root(x), which need no
/// division.
[[nodiscard]] constexpr std::uint64_t quick_root(std::uint64_t x) {
  constexpr std::uint64_t kThree = std::uint64_t{3} << 30U;
  const unsigned half = static_cast<unsigned>(std::countl_zero(x)) / 2U;
  const std::uint64_t m = x << (2U * half) >> 32U;                      // 2^30 to 2^32: a share of 2^32
  std::uint64_t r = kInverseRoots[static_cast<std::size_t>(m >> 24U)];  // 2^15 / its root
  r = r * (kThree - (r * r * m >> 32U)) >> 16U;                         // in 2^-30
  r = r * (kThree - ((r * r >> 30U) * m >> 32U)) >> 31U;
  std::uint64_t root = m * r >> (30U + half);
  if (root * root > x) --root;
  if ((root + 1) * (root + 1) <= x) ++root;
  return root;
}

/// The root of a squared length, rounded down: mostly quick_root().
[[nodiscard]] constexpr std::int64_t length_of(std::uint64_t squared) {
  if (squared == 0) return 0;
  return static_cast<std::int64_t>((squared >> 56U) == 0 ? quick_root(squared) : square_root(squared));
}

}  // namespace tandem
