#pragma once
// The integer state that a server and all of its clients hold bit-identically.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/turn.hpp"

namespace tandem {

using Slot = std::uint32_t;
using Frame = std::uint64_t;
using Epoch = std::uint64_t;
using TypeId = std::uint16_t;
using Vec3i = std::array<std::int32_t, 3>;

/// Channels of the group that every stream has.
inline constexpr std::size_t kPositionChannels = 3;
inline constexpr std::uint32_t kMaxCapacity = 1U << 20U;
/// Slots are cut into runs of this many; each run is coded on its own, with indices local to it.
inline constexpr std::uint32_t kBlockSlots = 16384;
inline constexpr std::int32_t kPositionLimit = 1 << 30;
inline constexpr std::int32_t kVelocityLimit = 1 << 28;

[[nodiscard]] constexpr std::uint32_t block_count(std::uint32_t capacity) {
  return (capacity + kBlockSlots - 1) / kBlockSlots;
}

/// Channel groups beside position, which every stream has.
struct Groups {
  bool orientation = false;
  friend bool operator==(const Groups&, const Groups&) = default;
};

/// One body's place and speed. `p` in lattice units, |p| <= 2^30; `v` in 1/64 unit per frame, |v| <= 2^28.
/// `q` and `w`, valid ones, where the stream has orientations.
struct BodyState {
  Vec3i p{};
  Vec3i v{};
  Quaternion q = kNoTurn;
  Spin w{};
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

/// Structure of arrays over `capacity` slots. Invariant: every column of a dead slot is zero.
///
/// Columns: alive (0 or 1), reuse (counts the bodies a slot has held, wraps), type, rest (1: does not move
/// until it is corrected or the drive changes), per position channel p (lattice units), v (1/64 unit per
/// frame) and c (1/64 unit per frame^2), and with orientations the quaternion q and the angular velocity w
/// per frame (turn.hpp). Copying between equal capacities does not allocate. Not thread-safe; distinct
/// objects are independent.
class State {
 public:
  State() = default;
  /// All slots dead. `capacity` in [1, kMaxCapacity].
  explicit State(std::uint32_t capacity, const Groups& groups = {});

  [[nodiscard]] std::uint32_t capacity() const { return static_cast<std::uint32_t>(alive_.size()); }

  [[nodiscard]] Groups groups() const { return {!q_[0].empty()}; }

  std::span<std::uint8_t> alive() { return alive_; }
  [[nodiscard]] std::span<const std::uint8_t> alive() const { return alive_; }
  std::span<std::uint8_t> reuse() { return reuse_; }
  [[nodiscard]] std::span<const std::uint8_t> reuse() const { return reuse_; }
  std::span<TypeId> type() { return type_; }
  [[nodiscard]] std::span<const TypeId> type() const { return type_; }
  std::span<std::uint8_t> rest() { return rest_; }
  [[nodiscard]] std::span<const std::uint8_t> rest() const { return rest_; }
  std::span<std::int32_t> p(std::size_t channel) { return p_[channel]; }
  [[nodiscard]] std::span<const std::int32_t> p(std::size_t channel) const { return p_[channel]; }
  std::span<std::int32_t> v(std::size_t channel) { return v_[channel]; }
  [[nodiscard]] std::span<const std::int32_t> v(std::size_t channel) const { return v_[channel]; }
  std::span<std::int32_t> c(std::size_t channel) { return c_[channel]; }
  [[nodiscard]] std::span<const std::int32_t> c(std::size_t channel) const { return c_[channel]; }
  /// Empty without orientations.
  std::span<std::int32_t> q(std::size_t channel) { return q_[channel]; }
  [[nodiscard]] std::span<const std::int32_t> q(std::size_t channel) const { return q_[channel]; }
  std::span<std::int32_t> w(std::size_t channel) { return w_[channel]; }
  [[nodiscard]] std::span<const std::int32_t> w(std::size_t channel) const { return w_[channel]; }

  [[nodiscard]] BodyState body(Slot slot) const;
  /// With orientations alone.
  [[nodiscard]] Quaternion quaternion(Slot slot) const {
    return {q_[0][slot], q_[1][slot], q_[2][slot], q_[3][slot]};
  }
  void set_quaternion(Slot slot, const Quaternion& q) {
    for (std::size_t i = 0; i < kQuaternionChannels; ++i) q_[i][slot] = q[i];
  }
  /// Sets p, v, clamped to their limits, q and w, c = 0 and rest = 0. The slot's alive bit is left as it is.
  void set_body(Slot slot, const BodyState& body);
  /// Brings a slot to life with c = 0 and rest = 0.
  void spawn(Slot slot, std::uint8_t reuse, TypeId type, const BodyState& body);
  /// Kills a slot and zeroes all of its columns.
  void despawn(Slot slot);
  [[nodiscard]] std::uint32_t alive_count() const;
  [[nodiscard]] std::uint32_t rest_count() const;

  friend bool operator==(const State&, const State&) = default;

 private:
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint8_t> reuse_;
  std::vector<TypeId> type_;
  std::vector<std::uint8_t> rest_;
  std::array<std::vector<std::int32_t>, kPositionChannels> p_, v_, c_;
  std::array<std::vector<std::int32_t>, kQuaternionChannels> q_;
  std::array<std::vector<std::int32_t>, kSpinChannels> w_;
};

/// Euclidean length squared of a - b, exact: |components| are at most 2^30, so the sum fits 64 bits.
[[nodiscard]] inline std::uint64_t distance_squared(const Vec3i& a, const Vec3i& b) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t d = std::int64_t{a[i]} - b[i];
    sum += static_cast<std::uint64_t>(d * d);
  }
  return sum;
}

}  // namespace tandem
