#include "sdk/core/codec/paper/code_tables.hpp"

#include "sdk/core/codec/paper/residual.hpp"

namespace tandem {

std::vector<std::byte> code_tables(std::span<const SymbolCounts> counts) {
  std::vector<std::byte> tables;
  for (const SymbolCounts& each : counts) {
    for (const std::uint8_t length : build_code_lengths(each))
      tables.push_back(static_cast<std::byte>(length));
  }
  return tables;
}

std::vector<std::byte> default_code_tables(const Groups& groups) {
  SymbolCounts typical{};
  for (std::int64_t q = -128; q < 128; ++q)
    typical[static_cast<std::uint8_t>(q)] = static_cast<std::uint64_t>((1 << 20) / (4 + q * q));
  return code_tables(std::vector<SymbolCounts>(residual_vectors(groups), typical));
}

}  // namespace tandem
