#pragma once
// Orientations on the lattice: quaternions, and how an angular velocity turns them. All are integers, the
// same to the last bit everywhere. idl/PROTOCOL.md, "Turn", has the same formulas.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tandem {

/// x, y, z, w in 1/2^30, of norm 1: the turn from the body's frame to the world's. q and -q are the same
/// turn.
using Quaternion = std::array<std::int32_t, 4>;
/// An angular velocity per frame, or a rotation vector: world frame, 2^-28 rad. A valid one is at most 2 rad
/// long.
using Spin = std::array<std::int32_t, 3>;
/// A rotation vector of any length, 2^-28 rad; |components| < 2^62.
using WideSpin = std::array<std::int64_t, 3>;

inline constexpr std::size_t kQuaternionChannels = 4, kSpinChannels = 3;
inline constexpr std::int32_t kQuaternionOne = 1 << 30;
inline constexpr std::int32_t kSpinLimit = 1 << 29;  ///< maximum length of the vector
inline constexpr Quaternion kNoTurn{0, 0, 0, kQuaternionOne};

/// True if the norm is 1 within 2^-10, so that turns keep it there.
[[nodiscard]] bool valid_quaternion(const Quaternion& q);
/// True if the vector is not longer than kSpinLimit.
[[nodiscard]] bool valid_spin(const Spin& spin);
/// The vector, halved until it is valid.
[[nodiscard]] Spin limited_spin(WideSpin spin);

/// `q` turned by a valid `spin`. The norm stays within 1e-8 of 1; an inexact norm moves towards 1.
[[nodiscard]] Quaternion turned(const Quaternion& q, const Spin& spin);

/// A correction of an orientation.
struct Turned {
  Quaternion q;
  bool is_far;  ///< by more than 2 rad: no angular velocity is as high
};
/// `q` turned by limited_spin(by), twice where that halved the vector. So it is exact up to 4 rad, and every
/// turn is at most pi.
[[nodiscard]] Turned turned_by(const Quaternion& q, const WideSpin& by);

/// sin(angle / 2) of the turn from one to the other, in 2^-30, rounded up or one above.
[[nodiscard]] std::uint64_t half_sine(const Quaternion& from, const Quaternion& to);
/// The rotation vector (2^-28 rad, at most pi long) that turns `from` into `to`, within 1e-4 of its length.
[[nodiscard]] Spin turn_between(const Quaternion& from, const Quaternion& to);

/// The columns of many bodies, each as long as `still`.
struct TurnColumns {
  std::array<const std::int32_t*, kQuaternionChannels> from;
  std::array<std::int32_t*, kQuaternionChannels> to;  ///< may be `from`
  std::array<const std::int32_t*, kSpinChannels> spin;
};
/// Computes turned() of every body. A body with 1 in `still` does not change. A quaternion of zeros (a dead
/// slot) stays zero.
void turn_all(const TurnColumns& columns, std::span<const std::uint8_t> still);

}  // namespace tandem
