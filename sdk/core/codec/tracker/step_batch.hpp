#pragma once
// choose_steps() for many bodies side by side, in vector loops. It gives the same steps. Nothing here is on
// the wire.

#include <array>
#include <cstdint>

#include "sdk/core/codec/tracker/steps.hpp"

namespace tandem {

/// Collects bodies, then chooses the steps of all. Bodies whose numbers do not fit 32 bits are left to
/// choose_steps().
class StepBatch {
 public:
  static constexpr std::uint32_t kMaxBodies = 64;

  /// The arguments must outlive the batch.
  StepBatch(const TrackerSteppings& steppings, const ErrorWorth& moving, const ErrorWorth& at_rest,
            const TrackerCosts& costs);

  /// Adds a body; at most kMaxBodies. `rest`: its error has the worth of a body at rest.
  void add(const Vec3i& from, const Vec3i& to, bool rest);
  [[nodiscard]] bool is_full() const { return count_ == kMaxBodies; }
  [[nodiscard]] std::uint32_t size() const { return count_; }
  /// Chooses the steps of all bodies. context(i) is that of the i-th body.
  template <class Context>
  void run(const Context& context) {
    if (fits_) {
      measure();
      for (std::uint32_t i = 0; i < count_; ++i) price(i, context(i));
      search();
    }
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (!fits_ || !found(i) || is_far_[i] != 0) choose_alone(i, context(i));
    }
    count_ = 0;
  }
  /// After run(), as choose_steps() returns them.
  [[nodiscard]] bool inside(std::uint32_t i) const { return found(i); }
  [[nodiscard]] TrackerSteps steps(std::uint32_t i) const {
    return {static_cast<std::int32_t>(steps_[0][i]), static_cast<std::int32_t>(steps_[1][i]),
            static_cast<std::int32_t>(steps_[2][i])};
  }

 private:
  using Column = std::array<std::uint32_t, kMaxBodies>;
  static constexpr std::uint32_t kNone = UINT32_MAX;

  [[nodiscard]] bool found(std::uint32_t i) const { return best_[i] != kNone; }
  void measure();
  void price(std::uint32_t i, const TrackerContext& context);
  void search();
  void choose_alone(std::uint32_t i, const TrackerContext& context);

  const TrackerSteppings& steppings_;
  const ErrorWorth& moving_;
  const ErrorWorth& at_rest_;
  const TrackerCosts& costs_;
  bool fits_;
  std::uint32_t count_ = 0;
  std::array<Column, 3> from_{}, to_{};  // bits of signed numbers
  Column worth_{}, is_far_{};
  std::array<bool, kMaxBodies> is_at_rest_{};
  // By axis, as in choose_steps(): the size of the residual, whether it is negative, and the shorter of the
  // two lengths.
  std::array<Column, 3> size_{}, negative_{}, shorter_{};
  // In 1/256 bits: by x and y the cost of both; by x, y and z that of z. 1: the longer length.
  std::array<Column, 4> xy_cost_{};
  std::array<Column, 8> z_cost_{};
  Column best_{};                  // the least cost and its point
  std::array<Column, 3> steps_{};  // bits of signed numbers
};

}  // namespace tandem
