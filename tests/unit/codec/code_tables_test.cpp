#include "sdk/core/codec/paper/code_tables.hpp"

#include <gtest/gtest.h>

#include "sdk/core/codec/codec.hpp"

namespace tandem {
namespace {

TEST(CodeTables, FitTheCodecThatReadsThem) {
  const auto fit = [](std::string_view name, const std::vector<std::byte>& tables) {
    return make_codec({.name = name, .capacity = 10, .tables = tables}).has_value();
  };
  EXPECT_TRUE(fit("entropy", default_code_tables()));
  SymbolCounts counts{};
  counts[0] = 1000000;
  EXPECT_TRUE(fit("limited", code_tables(counts, {})));
}

}  // namespace
}  // namespace tandem
