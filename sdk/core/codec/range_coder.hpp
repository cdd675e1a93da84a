#pragma once
// Binary range coder: it codes one decision at a time, each with a 16-bit probability (G. N. N. Martin 1979).
// Carries are added to bytes already written, as in LZMA. Integers only; the bytes are in idl/PROTOCOL.md.
//
// All decisions so far stand for an interval [low, low + range) of fractions below 1. A decision with
// probability P / 2^16 of a 1 takes the first P / 2^16 of the interval for a 1 and the rest for a 0. So the
// interval shrinks by the probability of the decision, and the decision costs -log2 of it, the ideal length.
// In the end any number within the interval encodes all decisions; the one with the fewest bytes is written.
//
// Only 32 bits of range are held. When range is below 2^24, the leading byte of the number is settled, except
// for a carry, and both are shifted by a byte. So range is at least 2^24 when a decision is made. Rounding
// (range * P) >> 16 then takes less than 1/256 of a 1's share even at P = 1, which is 0.006 bits, and neither
// share is ever empty for P in 1 .. 65535.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tandem {

/// Writes decisions into caller memory. Beyond its end nothing is written and overflow() is set.
class RangeEncoder {
 public:
  explicit RangeEncoder(std::span<std::byte> out)
      : begin_(out.data()), at_(out.data()), end_(out.data() + out.size()) {}

  /// `p1`: probability of 1 in 1/65536, in 1 .. 65535; 0 for a bit that is never 1.
  void put(bool bit, std::uint32_t p1) {
    const auto bound = static_cast<std::uint32_t>((std::uint64_t{range_} * p1) >> 16U);
    const std::uint32_t rest = range_ - bound;
    const std::uint32_t one = 0U - static_cast<std::uint32_t>(bit);  // a mask instead of a branch: bits are
                                                                     // hard to predict
    low_ += bound & ~one;
    range_ = rest ^ ((rest ^ bound) & one);
    shift_out();
  }

  /// Writes many decisions, each as 2 * model + bit; `p1` is by model. As put(), with a shorter
  /// chain from one range to the next: a 0 leaves range - (range * p1 >> 16) = (range * (2^16 - p1) + 2^16 -
  /// 1) >> 16, so that both bits take one product.
  void put_all(std::span<const std::uint16_t> decisions, const std::uint16_t* p1) {
    Hot hot(*this);
    for (const std::uint32_t decision : decisions) hot.put(decision, p1, *this);
    hot.store(*this);
  }
  /// Does the same for two encoders in turn, whose chains then overlap. Both lists have as many decisions.
  static void put_all_of_two(RangeEncoder& a, const std::uint16_t* decisions_a, RangeEncoder& b,
                             const std::uint16_t* decisions_b, std::size_t count, const std::uint16_t* p1) {
    Hot hot_a(a), hot_b(b);
    for (std::size_t i = 0; i < count; ++i) {
      hot_a.put(decisions_a[i], p1, a);
      hot_b.put(decisions_b[i], p1, b);
    }
    hot_a.store(a);
    hot_b.store(b);
  }

  /// Writes `count` bits (at most 16), each equally likely 0 or 1, in one step: `value` < 2^count. The
  /// highest value also gets the remainder of the division.
  void put_even(std::uint32_t value, unsigned count) {
    const std::uint32_t share = range_ >> count;
    const bool is_last = value == (1U << count) - 1;
    low_ += std::uint64_t{share} * value;
    range_ = is_last ? range_ - share * value : share;
    shift_out();
  }

  /// Ends the code with the fewest bytes that decode to what was put, without zeros at the end. Returns the
  /// size.
  std::size_t finish() {
    for (unsigned bytes = 0; bytes <= 4; ++bytes) {
      const std::uint64_t mask = std::uint64_t{0xFFFFFFFFU} >> (8U * bytes);
      const std::uint64_t value = (low_ + mask) & ~mask;
      if (value - low_ >= range_) continue;
      low_ = value;
      flush();
      for (unsigned i = 0; i < bytes; ++i) emit(static_cast<std::byte>(value >> (24U - 8U * i)));
      break;
    }
    while (at_ != begin_ && at_[-1] == std::byte{0}) --at_;
    return static_cast<std::size_t>(at_ - begin_);
  }
  [[nodiscard]] bool overflow() const { return overflow_; }

 private:
  static constexpr std::uint32_t kLeastRange = 1U << 24U;
  static constexpr std::uint32_t kMaxHeld = 3;

  // What changes with each decision. It stays in registers: the compiler must assume that a write of a byte
  // changes any member.
  struct Hot {
    explicit Hot(const RangeEncoder& of) : low(of.low_), range(of.range_), held(of.held_) {}
    [[gnu::always_inline]] void put(std::uint32_t decision, const std::uint16_t* p1, RangeEncoder& of) {
      const std::uint32_t zero = (decision & 1U) - 1U;  // all bits are one for a 0
      const std::uint32_t share = (p1[decision >> 1U] ^ zero) + (zero & 0x10001U);
      const auto next = static_cast<std::uint32_t>((std::uint64_t{range} * share + (zero & 0xFFFFU)) >> 16U);
      low += (range - next) & zero;
      range = next;
      while (range < kLeastRange) {
        range <<= 8U;
        low <<= 8U;
        if (++held < kMaxHeld) continue;
        store(of);
        of.flush();
        low = of.low_;
        held = 0;
      }
    }
    void store(RangeEncoder& of) const {
      of.low_ = low;
      of.range_ = range;
      of.held_ = held;
    }
    std::uint64_t low;
    std::uint32_t range, held;
  };

  void shift_out() {
    while (range_ < kLeastRange) {
      range_ <<= 8U;
      low_ <<= 8U;
      if (++held_ == kMaxHeld) flush();
    }
  }
  void flush() {
    const std::uint64_t bytes = low_ >> 32U;
    if (bytes >> (8U * held_) != 0) carry();
    for (; held_ != 0; --held_) emit(static_cast<std::byte>(bytes >> (8U * held_ - 8U)));
    low_ &= 0xFFFFFFFFU;
  }
  void emit(std::byte byte) {
    if (at_ == end_) {
      overflow_ = true;
      return;
    }
    *at_++ = byte;
  }
  // The number written plus range is below 1, so a carry always finds a byte that is not 0xFF.
  void carry() {
    if (overflow_) return;
    std::byte* at = at_;
    while (at != begin_) {
      --at;
      *at = static_cast<std::byte>(std::to_integer<unsigned>(*at) + 1U);
      if (*at != std::byte{0}) return;
    }
  }

  std::byte* begin_;
  std::byte* at_;
  std::byte* end_;
  // From the top: a carry, held_ bytes that are not written yet, 32 bits. Three bytes are written at once.
  std::uint64_t low_ = 0;
  std::uint32_t held_ = 0;
  std::uint32_t range_ = 0xFFFFFFFFU;
  bool overflow_ = false;
};

/// Reads decisions from untrusted bytes; beyond their end it reads zeros. It never fails: the caller checks
/// whether the bytes make sense, with at_end() last.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::byte> in) : at_(in.data()), end_(in.data() + in.size()) {
    if (!in.empty() && in.back() == std::byte{0}) padded_ = true;
    for (int i = 0; i < 4; ++i) code_ = (code_ << 8U) | next();
  }

  bool get(std::uint32_t p1) {
    const auto bound = static_cast<std::uint32_t>((std::uint64_t{range_} * p1) >> 16U);
    const bool bit = code_ < bound;
    code_ -= bit ? 0U : bound;
    range_ = bit ? bound : range_ - bound;
    fill();
    return bit;
  }

  /// Does the same without a branch on the bit, for bits that are hard to predict and decide little.
  bool get_masked(std::uint32_t p1) {
    const auto bound = static_cast<std::uint32_t>((std::uint64_t{range_} * p1) >> 16U);
    const std::uint32_t rest = range_ - bound;
    const std::uint32_t one = 0U - static_cast<std::uint32_t>(code_ < bound);
    range_ = rest ^ ((rest ^ bound) & one);
    code_ -= bound & ~one;
    fill();
    return (one & 1U) != 0;
  }

  /// Reads what put_even() wrote.
  std::uint32_t get_even(unsigned count) {
    const std::uint32_t share = range_ >> count;
    const std::uint32_t last = (1U << count) - 1;
    const std::uint32_t value = std::min(code_ / share, last);
    code_ -= share * value;
    range_ = value == last ? range_ - share * value : share;
    fill();
    return value;
  }

  /// True if every byte was used and the last one is not a zero that could have been left out.
  [[nodiscard]] bool at_end() const { return at_ == end_ && !padded_; }

 private:
  static constexpr std::uint32_t kLeastRange = 1U << 24U;

  void fill() {
    while (range_ < kLeastRange) {
      code_ = (code_ << 8U) | next();
      range_ <<= 8U;
    }
  }
  std::uint32_t next() { return at_ == end_ ? 0U : std::to_integer<std::uint32_t>(*at_++); }

  const std::byte* at_;
  const std::byte* end_;
  std::uint32_t code_ = 0;
  std::uint32_t range_ = 0xFFFFFFFFU;
  bool padded_ = false;
};

}  // namespace tandem
