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
    std::uint32_t moved = 0, longest = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::int32_t steps = correction.steps[axis];
      const auto moves = static_cast<std::uint32_t>(steps != 0);
      const auto length = static_cast<std::uint32_t>(steps < 0 ? -steps : steps);
      put(moves != 0, zero_model(context, axis, moved));
      count_ += axis != 2 || moved != 0 ? 1 : 0;
      put(steps < 0, context.sign[axis]);
      count_ += moves;
      const std::uint32_t size_class = moves != 0 ? tracker_detail::size_class(length) : 0;
      put_class(magnitude_model(context, axis, longest), size_class);
      count_ += moves * std::min(size_class + 1, TrackerModelIndex::kClasses);
      if (size_class >= TrackerModelIndex::kShortClasses) put_place(context, size_class, length);
      moved += moves;
      longest = std::max(longest, length);
    }
  }

 private:
  static constexpr std::size_t kRoom = 4096, kMostOfCorrection = 1024;
  static_assert(kMostOfCorrection >= 4 + 2 * 3 * (2 + TrackerModelIndex::kClasses + 2 * 31 + 16));

  void put(bool bit, std::uint32_t model) {
    list_[count_] = static_cast<std::uint16_t>(2 * model + static_cast<std::uint32_t>(bit));
  }
  // Writes "is it of a longer class" of all classes, used or not.
  void put_class(std::uint32_t base, std::uint32_t size_class) {
    using Eight = std::uint16_t __attribute__((vector_size(16)));
    constexpr Eight kClasses{0, 1, 2, 3, 4, 5, 6, 7};
    const auto wanted = static_cast<std::uint16_t>(size_class);
    const auto first = static_cast<std::uint16_t>(2 * base);
    for (std::uint16_t half = 0; half < 16; half = static_cast<std::uint16_t>(half + 8)) {
      const Eight classes = kClasses + half;
      const Eight list = (classes + classes) + first + (reinterpret_cast<Eight>(classes < wanted) & 1);
      std::memcpy(list_.data() + count_ + half, &list, sizeof list);
    }
  }
  // Lists the place of a length in its class, or beyond all classes.
  void put_place(const TrackerContext& context, std::uint32_t size_class, std::uint32_t length) {
    if (size_class >= TrackerModelIndex::kClasses) {
      std::uint32_t beyond = length - tracker_detail::kBeyondClasses;
      tracker_detail::code_escape(*this, context.steps + TrackerModelIndex::kEscape, beyond);
      return;
    }
    const auto [first, bits] = tracker_detail::kSizeClasses[size_class];
    const std::uint32_t place = length - first;
    code(((place >> (bits - 1U)) & 1U) != 0,
         context.steps + TrackerModelIndex::kPlace - TrackerModelIndex::kShortClasses + size_class);
    for (unsigned bit = bits - 1U; bit-- > 0;) code_even(((place >> bit) & 1U) != 0);
  }

  std::size_t count_ = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
  std::array<std::uint16_t, kRoom> list_;
};

}  // namespace tandem
