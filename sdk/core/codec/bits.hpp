#pragma once
// Bits in bytes, most significant first.

#include <cstddef>
#include <cstdint>
#include <span>

namespace tandem {

/// Writes bits into memory that the caller knows to be large enough. The last byte is padded with zeros.
class BitWriter {
 public:
  explicit BitWriter(std::byte* to) : to_(to) {}
  /// `length` <= 32 and `bits` < 2^length.
  void put(std::uint32_t bits, unsigned length) {
    window_ = (window_ << length) | bits;
    held_ += length;
    while (held_ >= 8) {
      held_ -= 8;
      *to_++ = static_cast<std::byte>(window_ >> held_);
    }
  }
  void finish() {
    if (held_ > 0) *to_++ = static_cast<std::byte>(window_ << (8 - held_));
    held_ = 0;
  }

 private:
  std::byte* to_;
  std::uint64_t window_ = 0;
  unsigned held_ = 0;
};

/// Reads bits from untrusted bytes. The window is aligned to its most significant bit.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> in) : at_(in.data()), end_(in.data() + in.size()) {}
  /// Fills the window: afterwards it holds at least 56 bits, or all that are left.
  void refill() {
    if (end_ - at_ >= 8) {
      std::uint64_t next = 0;
      for (std::size_t i = 0; i < 8; ++i) next = (next << 8U) | std::to_integer<std::uint64_t>(at_[i]);
      window_ |= next >> held_;
      at_ += (63U - held_) >> 3U;
      held_ |= 56U;
      return;
    }
    while (held_ <= 56 && at_ != end_) {
      window_ |= std::to_integer<std::uint64_t>(*at_++) << (56U - held_);
      held_ += 8;
    }
  }
  [[nodiscard]] std::uint64_t window() const { return window_; }
  /// Skips `length` < 64 bits, which the caller knows to be held.
  void skip(unsigned length) {
    window_ <<= length;
    held_ -= length;
  }
  /// Takes the next `length` <= 32 bits as a number. The caller knows them to be held.
  [[nodiscard]] std::uint32_t take(unsigned length) {
    if (length == 0) return 0;
    const auto bits = static_cast<std::uint32_t>(window_ >> (64U - length));
    skip(length);
    return bits;
  }
  [[nodiscard]] unsigned held() const { return held_; }
  /// True if only padding is left: fewer than eight bits, all zero.
  [[nodiscard]] bool at_end() const {
    return at_ == end_ && held_ < 8 && (held_ == 0 || (window_ >> (64U - held_)) == 0);
  }

 private:
  const std::byte* at_;
  const std::byte* end_;
  std::uint64_t window_ = 0;
  unsigned held_ = 0;
};

}  // namespace tandem
