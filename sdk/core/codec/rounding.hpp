#pragma once
// Rounding of a whole state, on both sides at once, before a snapshot is cut: the low bits of p, v and c are
// noise that nobody sees, and that no coder can make smaller.

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// By how many bits p, v and c are rounded: to multiples of 2^n. idl/PROTOCOL.md, "Rounding".
struct Rounding {
  static constexpr std::uint8_t kMost = 24;  ///< bits; so the limits of p and v are multiples
  std::uint8_t p = 0;
  std::uint8_t v = 0;
  std::uint8_t c = 0;
  friend bool operator==(const Rounding&, const Rounding&) = default;
};

inline constexpr std::size_t kRoundingBytes = 3;

/// The coarsest that a session with this threshold (lattice units, 1 .. 2^30) hardly feels: p to at most 1/8
/// of it, v to 1/32 of it per frame, c to 1/256 of it per frame^2. Twice as much of v and c costs five times
/// the corrections in quiet scenes (tracker/RESEARCH.md, "Snapshots").
[[nodiscard]] constexpr Rounding rounding_for(std::int32_t threshold) {
  const auto bits_of = [](std::int64_t step) {
    const int bits =
        static_cast<int>(std::bit_width(static_cast<std::uint64_t>(std::max<std::int64_t>(1, step)))) - 1;
    return static_cast<std::uint8_t>(std::min(bits, int{Rounding::kMost}));
  };
  // v and c count in 1/64 units.
  return {bits_of(threshold / 8), bits_of(std::int64_t{2} * threshold), bits_of(threshold / 4)};
}

/// The content of a section.
inline void write_rounding(const Rounding& rounding, ByteWriter& out) {
  for (const std::uint8_t bits : {rounding.p, rounding.v, rounding.c}) out.put(bits);
}
/// From untrusted bytes. Errors: kMalformed.
[[nodiscard]] Result<Rounding> read_rounding(std::span<const std::byte> section);

/// Rounds p of every alive body: before its delta's corrections.
void round_positions(const Rounding& rounding, State& state);
/// Rounds v and c of every alive body that is not at rest: after them.
void round_motion(const Rounding& rounding, State& state);

}  // namespace tandem
