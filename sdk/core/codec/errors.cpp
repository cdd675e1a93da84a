#include "sdk/core/codec/errors.hpp"

#include <algorithm>
#include <array>

#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

// to * conjugate(from), of a sign that makes it the shorter turn.
Quaternion difference(const Quaternion& from, const Quaternion& to) {
  const auto [ax, ay, az, aw] = std::array<std::int64_t, 4>{-from[0], -from[1], -from[2], from[3]};
  const auto [bx, by, bz, bw] = std::array<std::int64_t, 4>{to[0], to[1], to[2], to[3]};
  const std::array<std::int64_t, 4> d{
      bw * ax + bx * aw + by * az - bz * ay, bw * ay - bx * az + by * aw + bz * ax,
      bw * az + bx * ay - by * ax + bz * aw, bw * aw - bx * ax - by * ay - bz * az};
  const std::int64_t sign = d[3] < 0 ? -1 : 1;
  Quaternion result{};
  for (std::size_t i = 0; i < 4; ++i) result[i] = static_cast<std::int32_t>((sign * d[i] + (1 << 29)) >> 30);
  return result;
}

// sin(angle / 2)^2 of a difference, in 2^-60.
std::uint64_t half_sine_squared(const Quaternion& difference) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i)
    sum += static_cast<std::uint64_t>(std::int64_t{difference[i]} * difference[i]);
  return sum;
}

}  // namespace

std::uint64_t surface_error(const BodyState& body, const BodyState& target, std::int32_t radius) {
  std::uint64_t squared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint64_t d = magnitude(body.p[i], target.p[i]);
    squared += d * d;
  }
  const std::uint64_t apart = squared == 0 ? 0 : square_root(squared - 1) + 1;
  if (body.q == target.q) return apart;
  const std::uint64_t half_sine = square_root(half_sine_squared(difference(body.q, target.q))) + 1;
  return apart + ((std::uint64_t{2} * static_cast<std::uint32_t>(radius) * half_sine) >> 30U) + 1;
}

namespace {

// Of the half angle h: h / sin h by the series of the arc sine in sin^2; up to 1 rad it is off by 1/200.
std::array<std::int64_t, 3> rough_turn_between(const Quaternion& from, const Quaternion& to) {
  const Quaternion d = difference(from, to);
  const auto x = static_cast<std::int64_t>(half_sine_squared(d) >> 32U);  // 2^-28
  std::int64_t ratio = 0;                                                 // 2^-28
  // 63/2816, 35/1152, 5/112, 3/40, 1/6, 1
  for (const std::int64_t term : {6005481, 8155591, 11983726, 20132659, 44739243, 268435456})
    ratio = ((ratio * x) >> 28) + term;
  std::array<std::int64_t, 3> spin{};
  for (std::size_t i = 0; i < 3; ++i) spin[i] = (d[i] * ratio) >> 29;
  return spin;
}

// The same direction, at most 2 rad long.
Spin shortened(std::array<std::int64_t, 3> spin) {
  std::uint64_t squared = 0;
  for (const std::int64_t a : spin) squared += static_cast<std::uint64_t>(a * a);
  const auto length = static_cast<std::int64_t>(square_root(squared)) + 1;
  if (length > kSpinLimit) {
    for (std::int64_t& a : spin) a = a * kSpinLimit / length;
  }
  return limited_spin(spin);
}

}  // namespace

Spin turn_between(const Quaternion& from, const Quaternion& to) {
  const Spin rough = shortened(rough_turn_between(from, to));
  // What it is off by turns about the same axis.
  std::array<std::int64_t, 3> spin = rough_turn_between(turned(from, rough), to);
  for (std::size_t i = 0; i < 3; ++i) spin[i] += rough[i];
  return shortened(spin);
}

void mark_suspects(const State& state, const State& target, const Block& block, std::int32_t threshold,
                   std::span<std::uint8_t, kBlockSlots> marks) {
  // A body within threshold / sqrt(3) on every axis is within the threshold. 37837 / 2^16 is just below 1 /
  // sqrt(3).
  const auto near = static_cast<std::uint32_t>((static_cast<std::uint64_t>(threshold) * 37837U) >> 16U);
  const std::int32_t* x0 = state.p(0).data() + block.first;
  const std::int32_t* y0 = state.p(1).data() + block.first;
  const std::int32_t* z0 = state.p(2).data() + block.first;
  const std::int32_t* x1 = target.p(0).data() + block.first;
  const std::int32_t* y1 = target.p(1).data() + block.first;
  const std::int32_t* z1 = target.p(2).data() + block.first;
  // |a - b| > near in one unsigned comparison; differences of up to 2^31 wrap and still compare right.
  const auto beyond = [near](std::int32_t a, std::int32_t b) {
    const std::uint32_t shifted = static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b) + near;
    return static_cast<std::uint8_t>(shifted > 2 * near);
  };
  std::uint8_t* mark = marks.data();
  // A copy: a store to a byte could change the block, for all a compiler knows.
  const std::uint32_t slots = block.slots;
  for (std::uint32_t s = 0; s < slots; ++s) {
    mark[s] = static_cast<std::uint8_t>(beyond(x1[s], x0[s]) | beyond(y1[s], y0[s]) | beyond(z1[s], z0[s]));
  }
  const std::uint32_t whole = (block.slots + 7U) & ~7U;
  std::fill(marks.begin() + block.slots, marks.begin() + whole, std::uint8_t{0});
}

}  // namespace tandem
