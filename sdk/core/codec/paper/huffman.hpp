#pragma once
// Canonical Huffman codes over bytes, limited in length.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/core/codec/bits.hpp"

namespace tandem {

inline constexpr std::size_t kSymbols = 256;
/// Three codes of this length always fit the 56 bits that one refill of the decoder guarantees.
inline constexpr unsigned kMaxCodeLength = 18;

/// One length per symbol. Every symbol has a code, so that anything can be sent.
using CodeLengths = std::array<std::uint8_t, kSymbols>;
using SymbolCounts = std::array<std::uint64_t, kSymbols>;

/// The optimal lengths <= kMaxCodeLength for counts + 1 (Larmore, Hirschberg 1990, package-merge). Allocates.
[[nodiscard]] CodeLengths build_code_lengths(const SymbolCounts& counts);

/// True if all lengths are in 1 .. kMaxCodeLength and fill the code space exactly.
[[nodiscard]] bool is_complete_code(const CodeLengths& lengths);

/// Tables of one canonical code. Codes of one length count up by symbol, and shorter codes come first (as in
/// RFC 1951).
class HuffmanCode {
 public:
  /// `lengths` must satisfy is_complete_code().
  explicit HuffmanCode(const CodeLengths& lengths);

  [[nodiscard]] unsigned length(std::uint8_t symbol) const { return lengths_[symbol]; }
  [[nodiscard]] unsigned longest() const { return longest_; }
  void put(BitWriter& out, std::uint8_t symbol) const { out.put(codes_[symbol], lengths_[symbol]); }

  struct Symbol {
    std::uint8_t value;
    std::uint8_t length;
  };
  /// Decodes the code at the top of `window`. Every bit pattern is a code, because the code is complete.
  [[nodiscard]] Symbol peek(std::uint64_t window) const {
    const Symbol quick = lookup_[window >> (64U - kLookupBits)];
    return quick.length != 0 ? quick : peek_long(window);
  }

 private:
  static constexpr unsigned kLookupBits = 11;
  [[nodiscard]] Symbol peek_long(std::uint64_t window) const;

  CodeLengths lengths_{};
  unsigned longest_ = 0;
  std::array<std::uint32_t, kSymbols> codes_{};
  std::array<Symbol, 1U << kLookupBits> lookup_{};  // length 0: longer than kLookupBits
  std::array<std::uint32_t, kMaxCodeLength + 1> first_code_{};
  std::array<std::uint32_t, kMaxCodeLength + 1> first_index_{};
  std::array<std::uint32_t, kMaxCodeLength + 1> count_{};
  std::array<std::uint8_t, kSymbols> by_code_{};  // symbols in the order of their codes
};

}  // namespace tandem
