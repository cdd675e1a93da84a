#pragma once
// Reads and writes network bytes, little-endian. The reader is bounded and never throws.

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {

/// The number of bytes of `value` as LEB128 in its shortest form.
[[nodiscard]] constexpr std::size_t leb128_bytes(std::uint64_t value) {
  std::size_t bytes = 1;
  while ((value >>= 7U) != 0) ++bytes;
  return bytes;
}

/// Maps 0, -1, 1, -2, ... to 0, 1, 2, 3, ...
[[nodiscard]] constexpr std::uint32_t zigzag(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1U) ^ static_cast<std::uint32_t>(value >> 31);
}
[[nodiscard]] constexpr std::int32_t from_zigzag(std::uint32_t value) {
  return static_cast<std::int32_t>((value >> 1U) ^ (0U - (value & 1U)));
}

/// Appends to caller memory. Writing beyond the end sets `overflow()` and drops the bytes.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::byte> out) : out_(out) {}

  template <std::integral T>
  void put(T value) {
    using U = std::make_unsigned_t<T>;
    if (!reserve(sizeof(T))) return;
    auto bits = static_cast<U>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      out_[size_ + i] = static_cast<std::byte>(static_cast<std::uint64_t>(bits) >> (8U * i));
    }
    size_ += sizeof(T);
  }
  void put_bytes(std::span<const std::byte> bytes) {
    if (!reserve(bytes.size())) return;
    std::copy(bytes.begin(), bytes.end(), out_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += bytes.size();
  }
  /// Writes seven bits per byte, lowest first; bit 7 is set in all bytes but the last.
  void put_leb128(std::uint64_t value) {
    for (; value >= 0x80U; value >>= 7U) put(static_cast<std::uint8_t>(value | 0x80U));
    put(static_cast<std::uint8_t>(value));
  }
  /// Inserts at `at` the number of bytes written since size() was `at`, as LEB128.
  void put_length_before(std::size_t at) {
    TANDEM_ASSERT(at <= size_);
    const std::size_t length = size_ - at;
    const std::size_t header = leb128_bytes(length);
    if (!reserve(header)) return;
    const auto begin = out_.begin() + static_cast<std::ptrdiff_t>(at);
    const auto end = out_.begin() + static_cast<std::ptrdiff_t>(size_);
    std::copy_backward(begin, end, end + static_cast<std::ptrdiff_t>(header));
    ByteWriter(out_.subspan(at, header)).put_leb128(length);
    size_ += header;
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool overflow() const { return overflow_; }
  [[nodiscard]] std::span<std::byte> rest() const { return out_.subspan(size_); }
  /// Counts bytes that the caller wrote into rest().
  void advance(std::size_t count) {
    if (reserve(count)) size_ += count;
  }
  [[nodiscard]] std::span<const std::byte> written() const { return out_.first(size_); }

 private:
  bool reserve(std::size_t count) {
    if (out_.size() - size_ < count) overflow_ = true;
    return !overflow_;
  }
  std::span<std::byte> out_;
  std::size_t size_ = 0;
  bool overflow_ = false;
};

/// Reads from untrusted bytes. Reading beyond the end gives zero and clears `ok()` for good.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> in) : in_(in) {}

  template <std::integral T>
  [[nodiscard]] T get() {
    if (!available(sizeof(T))) return T{};
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bits |= std::to_integer<std::uint64_t>(in_[at_ + i]) << (8U * i);
    }
    at_ += sizeof(T);
    return static_cast<T>(static_cast<std::make_unsigned_t<T>>(bits));
  }
  /// Reads LEB128 of the shortest form and at most `most_bytes` (at most 9). Anything else reads as zero and
  /// clears ok().
  [[nodiscard]] std::uint64_t get_leb128(std::size_t most_bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < most_bytes; ++i) {
      const std::uint64_t byte = get<std::uint8_t>();
      value |= (byte & 0x7FU) << (7U * i);
      if (byte < 0x80U) {
        if (ok_ && (byte != 0 || i == 0)) return value;
        break;
      }
    }
    ok_ = false;
    return 0;
  }
  [[nodiscard]] std::span<const std::byte> get_bytes(std::size_t count) {
    if (!available(count)) return {};
    at_ += count;
    return in_.subspan(at_ - count, count);
  }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return in_.size() - at_; }
  [[nodiscard]] bool at_end() const { return ok_ && remaining() == 0; }

 private:
  bool available(std::size_t count) {
    if (remaining() < count) ok_ = false;
    return ok_;
  }
  std::span<const std::byte> in_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace tandem
