#pragma once
// The integer state that a server and all of its clients hold bit-identically.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/groups.hpp"

namespace tandem {

using Frame = std::uint64_t;
using Epoch = std::uint64_t;
using TypeId = std::uint16_t;

/// Number of channels of the group that every stream has.
inline constexpr std::size_t kPositionChannels = 3;
inline constexpr std::uint32_t kMaxCapacity = 1U << 22U;
/// Number of slots of a block. Each block is coded on its own, with local indices.
inline constexpr std::uint32_t kBlockSlots = 16384;

[[nodiscard]] constexpr std::uint32_t block_count(std::uint32_t capacity) {
  return (capacity + kBlockSlots - 1) / kBlockSlots;
}

/// A structure of arrays over `capacity` slots. Invariant: every column of a dead slot is zero.
///
/// Columns: alive (0 or 1); reuse (counts the bodies that a slot has held, wraps); type; rest (1: the body
/// does not move until it is corrected or the drive changes); per position channel p (lattice units), v (1/64
/// unit per frame) and c (1/64 unit per frame^2); with orientations the quaternion q and the angular velocity
/// w per frame (turn.hpp). Copying between equal capacities does not allocate. Not thread-safe; distinct
/// objects are independent.
class State {
 public:
  State() = default;
  /// Makes a state with all slots dead. `capacity` in [1, kMaxCapacity].
  explicit State(std::uint32_t capacity, const Groups& groups = {});
  /// Gives every slot as many bytes of the predictor's own, all zero. Every state of a timeline has as many.
  void keep_for_predictor(std::uint32_t bytes_a_slot);

  [[nodiscard]] std::uint32_t capacity() const { return static_cast<std::uint32_t>(alive_.size()); }

  [[nodiscard]] Groups groups() const { return {.orientation = !q(0).empty()}; }

  std::span<std::uint8_t> alive() { return alive_; }
  [[nodiscard]] std::span<const std::uint8_t> alive() const { return alive_; }
  std::span<std::uint8_t> reuse() { return reuse_; }
  [[nodiscard]] std::span<const std::uint8_t> reuse() const { return reuse_; }
  std::span<TypeId> type() { return type_; }
  [[nodiscard]] std::span<const TypeId> type() const { return type_; }
  std::span<std::uint8_t> rest() { return rest_; }
  [[nodiscard]] std::span<const std::uint8_t> rest() const { return rest_; }
  /// The predictor's own columns of one byte a slot, one after another; empty if it has none.
  std::span<std::uint8_t> own() { return own_; }
  [[nodiscard]] std::span<const std::uint8_t> own() const { return own_; }
  /// One of the groups' columns, numbered in the order of kChannelGroups; empty if the stream does not have
  /// its group.
  std::span<std::int32_t> column(std::size_t number) { return columns_[number]; }
  [[nodiscard]] std::span<const std::int32_t> column(std::size_t number) const { return columns_[number]; }
  std::span<std::int32_t> p(std::size_t channel) { return columns_[kP + channel]; }
  [[nodiscard]] std::span<const std::int32_t> p(std::size_t channel) const { return columns_[kP + channel]; }
  std::span<std::int32_t> v(std::size_t channel) { return columns_[kV + channel]; }
  [[nodiscard]] std::span<const std::int32_t> v(std::size_t channel) const { return columns_[kV + channel]; }
  std::span<std::int32_t> c(std::size_t channel) { return columns_[kC + channel]; }
  [[nodiscard]] std::span<const std::int32_t> c(std::size_t channel) const { return columns_[kC + channel]; }
  /// Empty without orientations.
  std::span<std::int32_t> q(std::size_t channel) { return columns_[kQ + channel]; }
  [[nodiscard]] std::span<const std::int32_t> q(std::size_t channel) const { return columns_[kQ + channel]; }
  std::span<std::int32_t> w(std::size_t channel) { return columns_[kW + channel]; }
  [[nodiscard]] std::span<const std::int32_t> w(std::size_t channel) const { return columns_[kW + channel]; }

  [[nodiscard]] BodyState body(Slot slot) const;
  /// Only with orientations.
  [[nodiscard]] Quaternion quaternion(Slot slot) const {
    return {q(0)[slot], q(1)[slot], q(2)[slot], q(3)[slot]};
  }
  /// Only with orientations.
  [[nodiscard]] Spin spin(Slot slot) const { return {w(0)[slot], w(1)[slot], w(2)[slot]}; }
  void set_quaternion(Slot slot, const Quaternion& turn) {
    for (std::size_t i = 0; i < kQuaternionChannels; ++i) q(i)[slot] = turn[i];
  }
  /// Sets p and v, clamped to their limits, q and w, c = 0 and rest = 0. The slot's alive bit does not
  /// change.
  void set_body(Slot slot, const BodyState& body);
  /// Does the same, and sets the predictor's own bytes to 0.
  void renew(Slot slot, const BodyState& body);
  /// Brings a slot to life with c = 0 and rest = 0.
  void spawn(Slot slot, std::uint8_t reuse, TypeId type, const BodyState& body);
  /// Kills a slot and zeroes all its columns.
  void despawn(Slot slot);
  [[nodiscard]] std::uint32_t alive_count() const;
  [[nodiscard]] std::uint32_t rest_count() const;

  friend bool operator==(const State&, const State&) = default;

 private:
  static constexpr std::size_t kP = kChannelGroups[0].first_column;
  static constexpr std::size_t kV = kP + kPositionChannels, kC = kV + kPositionChannels;
  static constexpr std::size_t kQ = kChannelGroups[1].first_column, kW = kQ + kQuaternionChannels;

  std::vector<std::uint8_t> alive_;
  std::vector<std::uint8_t> reuse_;
  std::vector<TypeId> type_;
  std::vector<std::uint8_t> rest_;
  std::vector<std::uint8_t> own_;
  std::array<std::vector<std::int32_t>, kColumns> columns_;
};

/// The exact squared length of a - b: |components| are at most 2^30, so the sum fits 64 bits.
[[nodiscard]] inline std::uint64_t distance_squared(const Vec3i& a, const Vec3i& b) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t d = std::int64_t{a[i]} - b[i];
    sum += static_cast<std::uint64_t>(d * d);
  }
  return sum;
}

}  // namespace tandem
