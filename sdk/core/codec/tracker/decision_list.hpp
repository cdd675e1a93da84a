#pragma once
// The encoder's decisions as a list, so that they are chosen in one loop and coded in another, both without
// branches that are hard to predict.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>

#include "sdk/core/codec/tracker/models.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {

/// The decisions in coding a block, counted while they are listed.
struct ListedCounts {
  TrackerCounts& of;
  SizeCounts sizes;  ///< add_to(of) at the end
};

/// A coder for code_correction() that lists decisions as 2 * model + bit.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): list_ is written before it is read
class DecisionList {
 public:
  /// Call before each correction: true if there may be no room for it.
  [[nodiscard]] bool is_full() const { return count_ > kRoom - kMaxOfCorrection; }
  [[nodiscard]] std::span<const std::uint16_t> decisions() const {
    TANDEM_ASSERT(count_ <= kRoom);
    return std::span(list_).first(count_);
  }
  void clear() { count_ = 0; }

  bool code(bool bit, std::uint32_t model) {
    put(bit, model);
    ++count_;
    return bit;
  }
  bool code_sign(bool bit, std::uint32_t model) { return code(bit, model); }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }

  /// Does the same as code_correction() for a stream without orientations, and counts the decisions. What is
  /// not coded is counted for kDead. The arguments are copies, so that the compiler knows that counting does
  /// not change them.
  [[gnu::always_inline]] void add(TrackerContext context, TrackerCorrection correction,
                                  ListedCounts& counts) {
    Adding at{list_.data() + count_, 0, 0};
    ++counts.of[context.rest][correction.rest ? 1 : 0];
    *at.end++ = decision(correction.rest, context.rest);
    add_axis<0>(context, correction.steps[0], at, counts);
    add_axis<1>(context, correction.steps[1], at, counts);
    add_axis<2>(context, correction.steps[2], at, counts);
    count_ = static_cast<std::size_t>(at.end - list_.data());
  }

 private:
  static constexpr std::size_t kRoom = 4096, kMaxOfCorrection = 1024;
  static_assert(kMaxOfCorrection >= 4 + 2 * 3 * (2 + TrackerModelIndex::kClasses + 2 * 31 + 16));

  // The class of a length up to this one is in a table; all longer ones have one of the last two.
  static constexpr auto kClassOf = [] {
    std::array<std::uint8_t, tracker_detail::kBeyondClasses + 1> classes{};
    for (std::uint32_t length = 1; length < classes.size(); ++length)
      classes[length] = static_cast<std::uint8_t>(tracker_detail::size_class(length));
    return classes;
  }();
  static_assert(tracker_detail::size_class(tracker_detail::kBeyondClasses) == TrackerModelIndex::kClasses);

  // A correction that is being listed.
  struct Adding {
    std::uint16_t* end;
    std::uint32_t moved, longest;
  };

  static std::uint16_t decision(bool bit, std::uint32_t model) {
    return static_cast<std::uint16_t>(2 * model + static_cast<std::uint32_t>(bit));
  }
  void put(bool bit, std::uint32_t model) { list_[count_] = decision(bit, model); }

  template <std::uint32_t axis>
  [[gnu::always_inline]] void add_axis(const TrackerContext& context, std::int32_t steps, Adding& at,
                                       ListedCounts& counts) {
    using Index = TrackerModelIndex;
    const auto moves = static_cast<std::uint32_t>(steps != 0);
    const auto negative = static_cast<std::uint32_t>(steps < 0);
    const auto length = (static_cast<std::uint32_t>(steps) ^ (0U - negative)) + negative;
    const std::uint32_t said = axis != 2 || at.moved != 0 ? 1 : 0;
    const std::uint32_t zero = zero_model(context, axis, at.moved);
    const std::uint32_t sign = context.sign[axis];
    *at.end = decision(moves != 0, zero);
    at.end += said;
    ++counts.of[said != 0 ? zero : Index::kDead][moves];
    *at.end = decision(negative != 0, sign);
    at.end += moves;
    ++counts.of[moves != 0 ? sign : Index::kDead][negative];
    const auto largest =
        static_cast<std::uint32_t>(at.longest > 0) + static_cast<std::uint32_t>(at.longest > 2);
    const std::uint32_t row = context.magnitude[axis] * Index::kLargest + largest;
    const std::uint32_t size_class = kClassOf[std::min(length, tracker_detail::kBeyondClasses)];
    put_class(context.steps + Index::kMagnitude + row * Index::kClasses, size_class, at.end);
    at.end += std::size_t{moves} * std::min(size_class + 1, Index::kClasses);
    counts.sizes.add(moves != 0 ? row : SizeCounts::kNone, size_class);
    if (size_class >= Index::kShortClasses) {
      count_ = static_cast<std::size_t>(at.end - list_.data());
      put_place(context.steps, size_class, length, counts);
      at.end = list_.data() + count_;
    }
    at.moved += moves;
    at.longest = std::max(at.longest, length);
  }

  // Writes "is it of a longer class" of all classes, used or not.
  static void put_class(std::uint32_t base, std::uint32_t size_class, std::uint16_t* to) {
    using Eight = std::uint16_t __attribute__((vector_size(16)));
    constexpr Eight kClasses{0, 1, 2, 3, 4, 5, 6, 7};
    const auto wanted = static_cast<std::uint16_t>(size_class);
    const auto first = static_cast<std::uint16_t>(2 * base);
    for (std::uint16_t half = 0; half < 16; half = static_cast<std::uint16_t>(half + 8)) {
      const Eight classes = kClasses + half;
      const Eight list = (classes + classes) + first + (reinterpret_cast<Eight>(classes < wanted) & 1);
      std::memcpy(to + half, &list, sizeof list);
    }
  }
  // Lists the place of a length in its class, or beyond all classes. `steps`: the first model of steps.
  [[gnu::noinline]] void put_place(std::uint32_t steps, std::uint32_t size_class, std::uint32_t length,
                                   ListedCounts& counts) {
    const std::size_t before = count_;
    if (size_class >= TrackerModelIndex::kClasses) {
      std::uint32_t beyond = length - tracker_detail::kBeyondClasses;
      tracker_detail::code_escape(*this, steps + TrackerModelIndex::kEscape, beyond);
    } else {
      const auto [first, bits] = tracker_detail::kSizeClasses[size_class];
      const std::uint32_t place = length - first;
      code(((place >> (bits - 1U)) & 1U) != 0,
           steps + TrackerModelIndex::kPlace - TrackerModelIndex::kShortClasses + size_class);
      for (unsigned bit = bits - 1U; bit-- > 0;) code_even(((place >> bit) & 1U) != 0);
    }
    for (std::size_t i = before; i < count_; ++i) ++counts.of[list_[i] / 2U][list_[i] % 2U];
  }

  std::size_t count_ = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
  std::array<std::uint16_t, kRoom> list_;
};

}  // namespace tandem
