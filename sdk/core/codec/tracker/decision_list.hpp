#pragma once
// The encoder's decisions as a list, so that they are chosen in one loop and coded in another, both without
// branches that are hard to predict.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>

#include "sdk/core/codec/tracker/models.hpp"

namespace tandem {

/// A coder for code_correction() that lists decisions as 2 * model + bit.
class DecisionList {
 public:
  /// Call before each correction: true if there may be no room for it.
  [[nodiscard]] bool is_full() const { return count_ > kRoom - kMostOfCorrection; }
  [[nodiscard]] std::span<const std::uint16_t> decisions() const { return std::span(list_).first(count_); }
  void clear() { count_ = 0; }

  bool code(bool bit, std::uint32_t model) {
    put(bit, model);
    ++count_;
    return bit;
  }
  bool code_sign(bool bit, std::uint32_t model) { return code(bit, model); }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }

  /// Does the same as code_correction() for a stream without orientations.
  void add(const TrackerContext& context, const TrackerCorrection& correction) {
    code(correction.rest, context.rest);
    std::uint32_t moved = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::int32_t steps = correction.steps[axis];
      const auto moves = static_cast<std::uint32_t>(steps != 0);
      const auto length = static_cast<std::uint32_t>(steps < 0 ? -steps : steps);
      put(moves != 0, zero_model(context, axis, moved));
      count_ += axis != 2 || moved != 0 ? 1 : 0;
      put(steps < 0, context.sign[axis]);
      count_ += moves;
      put_length(magnitude_model(context, moved), length);
      if (length > TrackerModelIndex::kUnary) {
        std::uint32_t beyond = length - TrackerModelIndex::kUnary - 1;
        tracker_detail::code_escape(*this, context.steps + TrackerModelIndex::kEscape, beyond);
      }
      moved += moves;
    }
  }

 private:
  static constexpr std::size_t kRoom = 4096, kMostOfCorrection = 1024;
  static_assert(kMostOfCorrection >= 4 + 2 * 3 * (2 + TrackerModelIndex::kUnary + 2 * 31 + 16));

  void put(bool bit, std::uint32_t model) {
    list_[count_] = static_cast<std::uint16_t>(2 * model + static_cast<std::uint32_t>(bit));
  }
  // Lists "is it longer than 1, 2, ..." up to the first no. It writes them all, used or not.
  void put_length(std::uint32_t base, std::uint32_t length) {
    using Eight = std::uint16_t __attribute__((vector_size(16)));
    constexpr Eight kSizes{1, 2, 3, 4, 5, 6, 7, 8};
    const auto longest = static_cast<std::uint16_t>(std::min(length, std::uint32_t{INT16_MAX}));
    const auto first = static_cast<std::uint16_t>(2 * base - 2);
    for (std::uint16_t half = 0; half < 16; half = static_cast<std::uint16_t>(half + 8)) {
      const Eight sizes = kSizes + half;
      const Eight list = (sizes + sizes) + first + (reinterpret_cast<Eight>(sizes < longest) & 1);
      std::memcpy(list_.data() + count_ + half, &list, sizeof list);
    }
    count_ += std::min(length, TrackerModelIndex::kUnary);
  }

  std::size_t count_ = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
  std::array<std::uint16_t, kRoom> list_;
};

}  // namespace tandem
