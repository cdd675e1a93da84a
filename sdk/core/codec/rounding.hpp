#pragma once
// Rounds a whole state, on both sides at once, before a snapshot is cut. The low bits of p, v and c are noise
// that is invisible and that no coder can make smaller.

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// The numbers of bits by which p, v and c are rounded: to multiples of 2^n. idl/PROTOCOL.md, "Rounding".
struct Rounding {
  static constexpr std::uint8_t kMost = 24;  ///< bits; the limits of p and v are multiples of 2^24
  std::uint8_t p = 0;
  std::uint8_t v = 0;
  std::uint8_t c = 0;
  friend bool operator==(const Rounding&, const Rounding&) = default;
};

inline constexpr std::size_t kRoundingBytes = 3;

/// The coarsest rounding that hardly affects a session with this threshold (lattice units, 1 .. 2^30): p to
/// at most 1/8 of it, v to 1/32 of it per frame, c to 1/256 of it per frame^2. Rounding v and c twice as
/// coarsely costs five times the corrections in quiet scenes (tracker/RESEARCH.md, "Snapshots").
[[nodiscard]] constexpr Rounding rounding_for(std::int32_t threshold) {
  const auto bits_of = [](std::int64_t step) {
    const int bits =
        static_cast<int>(std::bit_width(static_cast<std::uint64_t>(std::max<std::int64_t>(1, step)))) - 1;
    return static_cast<std::uint8_t>(std::min(bits, int{Rounding::kMost}));
  };
  // v and c are in 1/64 units.
  return {bits_of(threshold / 8), bits_of(std::int64_t{2} * threshold), bits_of(threshold / 4)};
}

/// Writes the content of a rounding section.
inline void write_rounding(const Rounding& rounding, ByteWriter& out) {
  for (const std::uint8_t bits : {rounding.p, rounding.v, rounding.c}) out.put(bits);
}
/// Reads untrusted bytes. Errors: kMalformed.
[[nodiscard]] Result<Rounding> read_rounding(std::span<const std::byte> section);

/// Rounds p of every alive body. Call it before the delta's corrections.
void round_positions(const Rounding& rounding, State& state);
/// Rounds v and c of every alive body that is not at rest. Call it after the corrections.
void round_motion(const Rounding& rounding, State& state);

}  // namespace tandem
