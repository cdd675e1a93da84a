#pragma once
// Little-endian reading and writing of network bytes. The reader is bounded and never throws.

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace tandem {

/// Appends to caller memory. Writing past the end sets `overflow()` and drops the bytes.
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
  /// Overwrites four bytes written before, as for a length known only afterwards.
  void patch_u32(std::size_t at, std::uint32_t value) {
    ByteWriter(out_.subspan(at, sizeof value)).put(value);
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool overflow() const { return overflow_; }
  [[nodiscard]] std::span<std::byte> rest() const { return out_.subspan(size_); }
  /// Counts bytes that somebody wrote into rest().
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

/// Reads from untrusted bytes. Reading past the end yields zero and clears `ok()` for good.
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
