#pragma once
// Codes numbers with a range coder whose models learn from every decision. Snapshots are made of such
// numbers. Most numbers are small, or close to one that both sides can guess. idl/PROTOCOL.md, "Numbers".

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "sdk/core/codec/range_coder.hpp"

namespace tandem {

/// The probability of a 1, in 1/65536. It learns fast at first, then slower: after 64 decisions the past
/// fades by 1/128 with each decision.
struct LearningModel {
  void learn(bool bit) {
    const auto rate = static_cast<unsigned>(std::bit_width(unsigned{seen}));
    const std::uint32_t wrong = bit ? 65536U - p1 : p1;
    const std::uint32_t left = wrong - (wrong >> rate);
    p1 = static_cast<std::uint16_t>(bit ? 65536U - left : left);
    seen = static_cast<std::uint8_t>(std::min(seen + 1, 127));
  }
  std::uint16_t p1 = 32768;
  std::uint8_t seen = 1;
};

/// The probabilities for numbers of one kind, by their number of bits.
struct NumberModels {
  static constexpr std::size_t kShort = 8;  ///< all longer numbers of one length are about equally likely
  LearningModel some;                       ///< is the number different from 0?
  std::array<LearningModel, 32> length;     ///< bits - 1, a binary tree with its root at [1]
  std::array<LearningModel, kShort + 1> sign;
  std::array<std::array<LearningModel, 4>, kShort + 1> next;  ///< the two bits below the highest, a tree with
                                                              ///< its root at [1]
};

/// Writes numbers into caller memory; beyond its end overflow() is set.
class NumberEncoder {
 public:
  explicit NumberEncoder(std::span<std::byte> out) : range_(out) {}
  bool decide(bool bit, LearningModel& model) {
    range_.put(bit, model.p1);
    model.learn(bit);
    return bit;
  }
  std::uint32_t even(std::uint32_t value, unsigned count) {
    range_.put_even(value, count);
    return value;
  }
  /// Returns the size. Zeros at the end are left out.
  std::size_t finish() { return range_.finish(); }
  [[nodiscard]] bool overflow() const { return range_.overflow(); }

 private:
  RangeEncoder range_;
};

/// Reads numbers from untrusted bytes. Beyond their end it reads arbitrary values. It ignores arguments that
/// an encoder would write.
class NumberDecoder {
 public:
  explicit NumberDecoder(std::span<const std::byte> in) : range_(in) {}
  bool decide(bool /*bit*/, LearningModel& model) {
    const bool bit = range_.get_masked(model.p1);
    model.learn(bit);
    return bit;
  }
  std::uint32_t even(std::uint32_t /*value*/, unsigned count) { return range_.get_even(count); }
  /// True if every byte was used and the last is not a zero that could have been left out.
  [[nodiscard]] bool at_end() const { return range_.at_end(); }

 private:
  RangeDecoder range_;
};

/// Maximum mean number of bits per number for many numbers, all at most `magnitude`. Models cannot be misled
/// into more. Each of the nine decisions takes about one bit if all are unlikely, and then not all numbers
/// are large.
[[nodiscard]] constexpr std::size_t most_number_bits(std::uint32_t magnitude) {
  return 6 + static_cast<std::size_t>(std::bit_width(magnitude));
}

/// Codes x, |x| < 2^32, and returns it. `Coder`: NumberEncoder, or NumberDecoder, which ignores the argument
/// x.
template <class Coder>
[[gnu::always_inline]] inline std::int64_t code_number(Coder& coder, NumberModels& models, std::int64_t x) {
  if (!coder.decide(x != 0, models.some)) return 0;
  const auto magnitude = static_cast<std::uint32_t>(x < 0 ? -x : x);
  const auto wanted = static_cast<std::uint32_t>(std::bit_width(magnitude)) - 1;
  std::uint32_t node = 1;
  for (unsigned i = 5; i-- > 0;)
    node =
        node << 1U | static_cast<std::uint32_t>(coder.decide(((wanted >> i) & 1U) != 0, models.length[node]));
  const unsigned bits = node - 31;
  unsigned left = bits - 1;  // below the highest
  std::uint32_t value = 1;
  bool negative = x < 0;
  if (bits <= NumberModels::kShort) {
    negative = coder.decide(negative, models.sign[bits]);
    for (auto& next = models.next[bits]; left > 0 && value < 4;) {
      --left;
      value = value << 1U |
              static_cast<std::uint32_t>(coder.decide(((magnitude >> left) & 1U) != 0, next[value]));
    }
    if (left > 0) value = value << left | coder.even(magnitude & ((1U << left) - 1), left);
  } else {
    const unsigned high = std::min(left, 15U);
    left -= high;
    const std::uint32_t tail = (magnitude >> left) & ((1U << high) - 1);
    const std::uint32_t both = coder.even(tail << 1U | static_cast<std::uint32_t>(negative), high + 1);
    negative = (both & 1U) != 0;
    value = value << high | both >> 1U;
    if (left > 0) value = value << left | coder.even(magnitude & ((1U << left) - 1), left);
  }
  return negative ? -std::int64_t{value} : std::int64_t{value};
}

}  // namespace tandem
