#pragma once
// Reads a fuzzer's bytes as a program: what arrives, when, and how it is damaged. Ends of bytes read as zero.

#include <cstdint>
#include <cstdlib>
#include <span>

#include "sdk/wire/limits.hpp"

namespace tandem::fuzz {

/// A broken promise ends the process, which a fuzzer reports.
inline void require(bool holds) {
  if (!holds) std::abort();
}

class Program {
 public:
  explicit Program(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool over() const { return at_ >= bytes_.size(); }
  std::uint8_t u8() { return over() ? std::uint8_t{0} : std::to_integer<std::uint8_t>(bytes_[at_++]); }
  std::uint64_t u64() {
    std::uint64_t value = 0;
    for (unsigned i = 0; i < 8; ++i) value |= std::uint64_t{u8()} << (8 * i);
    return value;
  }
  /// Small numbers mostly, any number sometimes.
  std::uint64_t number() {
    const std::uint8_t small = u8();
    return small < 250 ? small : u64();
  }
  std::int32_t i32() { return static_cast<std::int32_t>(static_cast<std::uint32_t>(u64() & 0xFFFFFFFFU)); }
  double real() {
    const std::uint64_t bits = u64();
    double value = 0;
    static_assert(sizeof value == sizeof bits);
    __builtin_memcpy(&value, &bits, sizeof value);
    return value;
  }
  transport::Bytes bytes(std::size_t most) {
    transport::Bytes out(number() % (most + 1));
    for (std::byte& byte : out) byte = std::byte{u8()};
    return out;
  }
  /// Changes up to three bytes of `target`, and sometimes its length.
  void damage(transport::Bytes& target) {
    for (unsigned count = u8() % 4; count > 0 && !target.empty(); --count) {
      target[u64() % target.size()] ^= std::byte{u8()};
    }
    if (u8() % 8 == 1) target.resize(u64() % (target.size() + 9));
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

}  // namespace tandem::fuzz
