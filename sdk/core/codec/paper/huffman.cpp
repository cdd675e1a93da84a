#include "sdk/core/codec/paper/huffman.hpp"

#include <algorithm>
#include <vector>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {

CodeLengths build_code_lengths(const SymbolCounts& counts) {
  // A package is a set of symbols. Each time a symbol is in a chosen package, its code grows by one bit.
  struct Package {
    std::uint64_t weight;
    std::vector<std::uint8_t> symbols;
  };
  const auto lighter = [](const Package& a, const Package& b) { return a.weight < b.weight; };
  std::vector<Package> leaves;
  for (std::size_t s = 0; s < kSymbols; ++s)
    leaves.push_back({counts[s] + 1, {static_cast<std::uint8_t>(s)}});
  std::stable_sort(leaves.begin(), leaves.end(), lighter);

  std::vector<Package> list = leaves;
  for (unsigned level = 1; level < kMaxCodeLength; ++level) {
    std::vector<Package> merged = leaves;
    for (std::size_t i = 0; i + 1 < list.size(); i += 2) {
      Package pair = list[i];
      pair.weight += list[i + 1].weight;
      pair.symbols.insert(pair.symbols.end(), list[i + 1].symbols.begin(), list[i + 1].symbols.end());
      merged.push_back(std::move(pair));
    }
    std::stable_sort(merged.begin(), merged.end(), lighter);
    list = std::move(merged);
  }
  CodeLengths lengths{};
  for (std::size_t i = 0; i < 2 * kSymbols - 2; ++i) {
    for (const std::uint8_t symbol : list[i].symbols) ++lengths[symbol];
  }
  TANDEM_ASSERT(is_complete_code(lengths));
  return lengths;
}

bool is_complete_code(const CodeLengths& lengths) {
  std::uint64_t filled = 0;
  for (const std::uint8_t length : lengths) {
    if (length < 1 || length > kMaxCodeLength) return false;
    filled += std::uint64_t{1} << (kMaxCodeLength - length);
  }
  return filled == std::uint64_t{1} << kMaxCodeLength;
}

HuffmanCode::HuffmanCode(const CodeLengths& lengths) : lengths_(lengths) {
  TANDEM_ASSERT(is_complete_code(lengths));
  std::uint32_t code = 0;
  std::uint32_t index = 0;
  for (unsigned length = 1; length <= kMaxCodeLength; ++length) {
    code <<= 1U;
    first_code_[length] = code;
    first_index_[length] = index;
    for (std::size_t s = 0; s < kSymbols; ++s) {
      if (lengths_[s] != length) continue;
      longest_ = length;
      by_code_[index++] = static_cast<std::uint8_t>(s);
      codes_[s] = code;
      if (length <= kLookupBits) {
        const std::size_t at = std::size_t{code} << (kLookupBits - length);
        const std::size_t size = std::size_t{1} << (kLookupBits - length);
        std::fill_n(lookup_.begin() + static_cast<std::ptrdiff_t>(at), size,
                    Symbol{static_cast<std::uint8_t>(s), static_cast<std::uint8_t>(length)});
      }
      ++code;
    }
    count_[length] = code - first_code_[length];
  }
}

HuffmanCode::Symbol HuffmanCode::peek_long(std::uint64_t window) const {
  unsigned length = kLookupBits + 1;
  for (; length < longest_; ++length) {
    const auto code = static_cast<std::uint32_t>(window >> (64U - length));
    if (code - first_code_[length] < count_[length]) break;
  }
  const auto code = static_cast<std::uint32_t>(window >> (64U - length));
  const std::uint32_t index = first_index_[length] + (code - first_code_[length]);
  return {by_code_[index], static_cast<std::uint8_t>(length)};
}

}  // namespace tandem
