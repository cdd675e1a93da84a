#pragma once
// Rounds a whole state, on both sides at once, before a snapshot is cut. The low bits of p, v, c, q and w are
// noise that is invisible and that no coder can make smaller.

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// The numbers of bits by which p, v, c, q and w are rounded: to multiples of 2^n. idl/PROTOCOL.md,
/// "Rounding".
struct Rounding {
  static constexpr std::uint8_t kMaxBits = 24;  ///< bits; the limits of p and v are multiples of 2^24
  static constexpr std::uint8_t kMaxQ = 18;     ///< bits of q; its norm stays 1 within 2^-11
  std::uint8_t p = 0;
  std::uint8_t v = 0;
  std::uint8_t c = 0;
  std::uint8_t q = 0;  ///< q and w: 0 in a stream of positions
  std::uint8_t w = 0;
  friend bool operator==(const Rounding&, const Rounding&) = default;
};

inline constexpr std::size_t kMaxRoundingBytes = 5;

/// The coarsest rounding that hardly affects a session with this threshold (lattice units, 1 .. 2^30): p to
/// at most 1/8 of it, v to 1/32 of it per frame, c to 1/256 of it per frame^2. Rounding v and c twice as
/// coarsely costs five times the corrections in quiet scenes (tracker/RESEARCH.md, "Snapshots"). q moves a
/// point at `radius` (lattice units; 0: no orientations) by at most 1/8 of the threshold, w by 1/32 per
/// frame.
[[nodiscard]] constexpr Rounding rounding_for(std::int32_t threshold, std::int32_t radius = 0) {
  const auto bits_of = [](std::int64_t step, std::uint8_t most = Rounding::kMaxBits) {
    const int bits =
        static_cast<int>(std::bit_width(static_cast<std::uint64_t>(std::max<std::int64_t>(1, step)))) - 1;
    return static_cast<std::uint8_t>(std::min(bits, int{most}));
  };
  const std::int64_t e = threshold;
  // v and c are in 1/64 units.
  Rounding rounding{bits_of(e / 8), bits_of(2 * e), bits_of(e / 4)};
  if (radius == 0) return rounding;
  // Rounded by 2^n, the four components of q are off by 2^n / 2^30 at most, which is half the angle; those of
  // w by less than 2^n / 2^28 rad.
  rounding.q = bits_of((e << 26) / radius, Rounding::kMaxQ);
  rounding.w = bits_of((e << 23) / radius);
  return rounding;
}

/// Writes the content of a rounding section.
void write_rounding(const Rounding& rounding, const Groups& groups, ByteWriter& out);
/// Reads untrusted bytes. Errors: kMalformed.
[[nodiscard]] Result<Rounding> read_rounding(std::span<const std::byte> section, const Groups& groups);

/// `q` rounded to multiples of 2^bits, and negated if its w is then negative; `q` itself where the result is
/// not valid, or bits = 0.
[[nodiscard]] Quaternion rounded(const Quaternion& q, unsigned bits);

/// Rounds p and q of every alive body. Call it before the delta's corrections.
void round_before_corrections(const Rounding& rounding, State& state);
/// Rounds q of every alive body, and v, c and w of those that are not at rest. Call it after the corrections.
void round_after_corrections(const Rounding& rounding, State& state);

}  // namespace tandem
