#include "sdk/core/codec/rounding.hpp"

#include "sdk/core/lattice/assert.hpp"
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

// A vector whose rounded components would be out of its range stays as it is.
template <class Vector>
Vector rounded_if_valid(const Vector& exact, unsigned bits, bool (&is_valid)(const Vector&)) {
  Vector vector = exact;
  round_all(vector, bits);
  return is_valid(vector) ? vector : exact;
}

void round_orientations(unsigned bits, State& state) {
  if (bits == 0) return;
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] != 0) state.set_quaternion(slot, rounded(state.quaternion(slot), bits));
  }
}

void round_spins(unsigned bits, State& state) {
  if (bits == 0) return;
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.rest()[slot] != 0) continue;
    const Spin w = rounded_if_valid(state.spin(slot), bits, valid_spin);
    for (std::size_t i = 0; i < w.size(); ++i) state.w(i)[slot] = w[i];
  }
}

}  // namespace

Quaternion rounded(const Quaternion& q, unsigned bits) {
  if (bits == 0) return q;
  Quaternion result = rounded_if_valid(q, bits, valid_quaternion);
  // -q is the same turn. With one sign, neighbours with the same turn have the same numbers.
  if (result[3] < 0) {
    for (std::int32_t& component : result) component = -component;
  }
  return result;
}

void write_rounding(const Rounding& rounding, const Groups& groups, ByteWriter& out) {
  for (const std::uint8_t bits : {rounding.p, rounding.v, rounding.c}) out.put(bits);
  if (!groups.orientation) return;
  for (const std::uint8_t bits : {rounding.q, rounding.w}) out.put(bits);
}

Result<Rounding> read_rounding(std::span<const std::byte> section, const Groups& groups) {
  ByteReader in(section);
  Rounding rounding{in.get<std::uint8_t>(), in.get<std::uint8_t>(), in.get<std::uint8_t>()};
  if (groups.orientation) {
    rounding.q = in.get<std::uint8_t>();
    rounding.w = in.get<std::uint8_t>();
  }
  if (!in.ok() || in.remaining() != 0) return fail(ErrorCode::kMalformed, "rounding of another length");
  if (std::max({rounding.p, rounding.v, rounding.c, rounding.w}) > Rounding::kMaxBits ||
      rounding.q > Rounding::kMaxQ) {
    return fail(ErrorCode::kMalformed, "rounding by too many bits");
  }
  return rounding;
}

void round_before_corrections(const Rounding& rounding, State& state) {
  TANDEM_ASSERT(rounding.p <= Rounding::kMaxBits && rounding.q <= Rounding::kMaxQ);
  for (std::size_t i = 0; i < kPositionChannels; ++i) round_all(state.p(i), rounding.p);
  if (state.groups().orientation) round_orientations(rounding.q, state);
}

void round_after_corrections(const Rounding& rounding, State& state) {
  TANDEM_ASSERT(rounding.v <= Rounding::kMaxBits && rounding.c <= Rounding::kMaxBits &&
                rounding.w <= Rounding::kMaxBits);
  if (state.groups().orientation) {
    round_orientations(rounding.q, state);
    round_spins(rounding.w, state);
  }
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    round_moving(state.v(i), rounding.v, state.rest());
    round_moving(state.c(i), rounding.c, state.rest());
  }
}

}  // namespace tandem
