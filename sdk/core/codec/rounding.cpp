#include "sdk/core/codec/rounding.hpp"

#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

// Dead slots are zero and stay so. Sums fit: |x| <= 2^30, and 2^(bits - 1) is less.
TANDEM_VECTOR_CLONES void round_all(std::span<std::int32_t> column, unsigned bits) {
  const std::int32_t half = bits == 0 ? 0 : 1 << (bits - 1);
  const auto kept = static_cast<std::int32_t>(~((1U << bits) - 1));
  for (std::int32_t& x : column) x = (x + half) & kept;
}

TANDEM_VECTOR_CLONES void round_moving(std::span<std::int32_t> column, unsigned bits,
                                       std::span<const std::uint8_t> rest) {
  const std::int32_t half = bits == 0 ? 0 : 1 << (bits - 1);
  const auto kept = static_cast<std::int32_t>(~((1U << bits) - 1));
  for (std::size_t i = 0; i < column.size(); ++i)
    column[i] = rest[i] != 0 ? column[i] : (column[i] + half) & kept;
}

}  // namespace

Result<Rounding> read_rounding(std::span<const std::byte> section) {
  if (section.size() != kRoundingBytes) return fail(ErrorCode::kMalformed, "rounding of another length");
  const auto bits = [section](std::size_t i) { return std::to_integer<std::uint8_t>(section[i]); };
  const Rounding rounding{bits(0), bits(1), bits(2)};
  if (std::max({rounding.p, rounding.v, rounding.c}) > Rounding::kMost)
    return fail(ErrorCode::kMalformed, "rounding by too many bits");
  return rounding;
}

void round_positions(const Rounding& rounding, State& state) {
  for (std::size_t i = 0; i < kPositionChannels; ++i) round_all(state.p(i), rounding.p);
}

void round_motion(const Rounding& rounding, State& state) {
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    round_moving(state.v(i), rounding.v, state.rest());
    round_moving(state.c(i), rounding.c, state.rest());
  }
}

}  // namespace tandem
