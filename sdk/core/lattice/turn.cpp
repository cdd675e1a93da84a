#include "sdk/core/lattice/turn.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

using Wide = std::int64_t;

// 1/d in 2^-28.
constexpr std::int32_t over(std::int32_t d) { return ((1 << 28) + d / 2) / d; }

// Products of 32 bits, and shifts whose result fits 32 bits: these suffice for vector units without 64-bit
// products and arithmetic shifts. A logical shift leaves the same 32 bits as an arithmetic one.
[[gnu::always_inline]] inline std::int32_t shifted(Wide x, unsigned bits) {
  return static_cast<std::int32_t>(static_cast<std::uint64_t>(x) >> bits);
}
[[gnu::always_inline]] inline Wide wide(std::int32_t a, std::int32_t b) { return Wide{a} * b; }
[[gnu::always_inline]] inline std::int32_t times(std::int32_t a, std::int32_t b) {
  return shifted(wide(a, b), 28);
}

// A term of Horner's rule: 1 - n t^2 / d, all of it in 2^-30 but t^2 in 2^-28.
[[gnu::always_inline]] inline std::int32_t term(std::int32_t n, std::int32_t t_squared,
                                                std::int32_t one_over_d) {
  return kQuaternionOne - times(times(n, t_squared), one_over_d);
}

[[gnu::always_inline]] inline std::int32_t unit(Wide sum) {
  return std::clamp(shifted(sum + (1 << 29), 30), -kQuaternionOne, kQuaternionOne);
}

// With t half the angle: the turn is (w / 2 * sin(t) / t, cos(t)), both series to t^10, which is exact to
// 2^-27 for t <= 1. A step of Newton's iteration for 1 / sqrt keeps the norm.
[[gnu::always_inline]] inline void turn(const std::int32_t (&w)[3], std::int32_t (&q)[4]) {
  const std::int32_t t = (times(w[0], w[0]) + times(w[1], w[1]) + times(w[2], w[2])) >> 2;
  std::int32_t s = kQuaternionOne;
  for (const std::int32_t d : {over(110), over(72), over(42), over(20), over(6)}) s = term(s, t, d);
  std::int32_t c = kQuaternionOne;
  for (const std::int32_t d : {over(90), over(56), over(30), over(12), over(2)}) c = term(c, t, d);
  const std::int32_t x = shifted(wide(w[0], s), 29);
  const std::int32_t y = shifted(wide(w[1], s), 29);
  const std::int32_t z = shifted(wide(w[2], s), 29);
  const std::int32_t r[4] = {unit(wide(c, q[0]) + wide(x, q[3]) + wide(y, q[2]) - wide(z, q[1])),
                             unit(wide(c, q[1]) - wide(x, q[2]) + wide(y, q[3]) + wide(z, q[0])),
                             unit(wide(c, q[2]) + wide(x, q[1]) - wide(y, q[0]) + wide(z, q[3])),
                             unit(wide(c, q[3]) - wide(x, q[0]) - wide(y, q[1]) - wide(z, q[2]))};
  std::uint64_t norm = std::uint64_t{1} << 28;
  for (const std::int32_t a : r) norm += static_cast<std::uint64_t>(wide(a, a)) >> 2;
  const auto factor = static_cast<std::int32_t>(3U * (1U << 29U) - static_cast<std::uint32_t>(norm >> 29));
  for (int i = 0; i < 4; ++i) q[i] = unit(wide(r[i], factor));
}

TANDEM_VECTOR_CLONES void turn_all(const std::int32_t* wx, const std::int32_t* wy, const std::int32_t* wz,
                                   const TurnColumns& columns, const std::uint8_t* still, std::size_t count) {
  const std::int32_t* const qx = columns.from[0];
  const std::int32_t* const qy = columns.from[1];
  const std::int32_t* const qz = columns.from[2];
  const std::int32_t* const qw = columns.from[3];
  std::int32_t* const rx = columns.to[0];
  std::int32_t* const ry = columns.to[1];
  std::int32_t* const rz = columns.to[2];
  std::int32_t* const rw = columns.to[3];
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
  for (std::size_t s = 0; s < count; ++s) {
    const std::int32_t w[3] = {wx[s], wy[s], wz[s]};
    std::int32_t q[4] = {qx[s], qy[s], qz[s], qw[s]};
    turn(w, q);
    const bool moved = still[s] == 0;
    rx[s] = moved ? q[0] : qx[s];
    ry[s] = moved ? q[1] : qy[s];
    rz[s] = moved ? q[2] : qz[s];
    rw[s] = moved ? q[3] : qw[s];
  }
}

Wide length_squared(Wide x, Wide y, Wide z) { return x * x + y * y + z * z; }

// to * conjugate(from), with the sign that makes it the shorter turn.
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

// The rotation vector of a difference, with h / sin h of the half angle h by the series of the arc sine in
// sin^2; up to 1 rad it is off by 1/200.
Spin rough_spin(const Quaternion& d) {
  const auto x = static_cast<std::int64_t>(half_sine_squared(d) >> 32U);  // 2^-28
  std::int64_t ratio = 0;                                                 // 2^-28
  // 63/2816, 35/1152, 5/112, 3/40, 1/6, 1
  for (const std::int64_t term : {6005481, 8155591, 11983726, 20132659, 44739243, 268435456})
    ratio = ((ratio * x) >> 28) + term;
  Spin spin{};
  for (std::size_t i = 0; i < 3; ++i) spin[i] = static_cast<std::int32_t>((d[i] * ratio) >> 29);
  return spin;
}

// The rotation vector of a difference of at most 2 rad. The error of the rough vector is a turn about the
// same axis.
Spin spin_of(const Quaternion& d) {
  const Spin estimate = rough_spin(d);
  const Spin rough = limited_spin({estimate[0], estimate[1], estimate[2]});
  const Spin rest = rough_spin(difference(turned(kNoTurn, rough), d));
  return {rough[0] + rest[0], rough[1] + rest[1], rough[2] + rest[2]};
}

// Half the turn: the normalised sum of the difference and of no turn.
Quaternion halved(const Quaternion& d) {
  TANDEM_ASSERT(d[3] >= 0);
  const std::array<std::int64_t, 4> sum{d[0], d[1], d[2], std::int64_t{d[3]} + kQuaternionOne};
  std::uint64_t squared = 0;
  for (const std::int64_t a : sum) squared += static_cast<std::uint64_t>(a * a);
  const auto length = static_cast<std::int64_t>(square_root(squared));
  Quaternion half{};
  for (std::size_t i = 0; i < 4; ++i) half[i] = static_cast<std::int32_t>(sum[i] * kQuaternionOne / length);
  return half;
}

}  // namespace

bool valid_quaternion(const Quaternion& q) {
  Wide norm = 0;  // in 2^-58
  for (const Wide a : q) {
    if (a < -kQuaternionOne || a > kQuaternionOne) return false;
    norm += (a * a) >> 2;
  }
  constexpr Wide kOne = Wide{1} << 58;
  return norm >= kOne - (kOne >> 10) && norm <= kOne + (kOne >> 10);
}

bool valid_spin(const Spin& spin) {
  for (const Wide a : spin) {
    if (a < -kSpinLimit || a > kSpinLimit) return false;
  }
  return length_squared(spin[0], spin[1], spin[2]) <= Wide{kSpinLimit} * kSpinLimit;
}

Spin limited_spin(WideSpin spin) {
  const auto fits = [&] {
    return std::all_of(spin.begin(), spin.end(),
                       [](Wide a) { return -kSpinLimit <= a && a <= kSpinLimit; }) &&
           length_squared(spin[0], spin[1], spin[2]) <= Wide{kSpinLimit} * kSpinLimit;
  };
  while (!fits()) {
    for (Wide& a : spin) a >>= 1;
  }
  return {static_cast<std::int32_t>(spin[0]), static_cast<std::int32_t>(spin[1]),
          static_cast<std::int32_t>(spin[2])};
}

Quaternion turned(const Quaternion& q, const Spin& spin) {
  const std::int32_t w[3] = {spin[0], spin[1], spin[2]};
  std::int32_t r[4] = {q[0], q[1], q[2], q[3]};
  turn(w, r);
  return {r[0], r[1], r[2], r[3]};
}

std::uint64_t half_sine(const Quaternion& from, const Quaternion& to) {
  return square_root(half_sine_squared(difference(from, to))) + 1;
}

Turned turned_by(const Quaternion& q, const WideSpin& by) {
  const Spin step = limited_spin(by);
  const Quaternion once = turned(q, step);
  const bool is_far = !std::equal(step.begin(), step.end(), by.begin());
  return {is_far ? turned(once, step) : once, is_far};
}

Spin turn_between(const Quaternion& from, const Quaternion& to) {
  constexpr std::int32_t kCosineOfOne = 580145192;  // beyond 2 rad the series is too far off
  const Quaternion d = difference(from, to);
  if (d[3] >= kCosineOfOne) return spin_of(d);
  Spin spin = spin_of(halved(d));
  for (std::int32_t& a : spin) a *= 2;
  return spin;
}

void turn_all(const TurnColumns& columns, std::span<const std::uint8_t> still) {
  turn_all(columns.spin[0], columns.spin[1], columns.spin[2], columns, still.data(), still.size());
}

}  // namespace tandem
