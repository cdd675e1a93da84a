#include "sdk/core/codec/paper/code_tables.hpp"

#include <gtest/gtest.h>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/tables/codec_table.hpp"

namespace tandem {
namespace {

TEST(CodeTables, FitTheCodecThatReadsThem) {
  const auto fit = [](std::string_view name, const std::vector<std::byte>& tables) {
    return make_codec({.name = name, .capacity = 10, .tables = tables}).has_value();
  };
  EXPECT_TRUE(fit("entropy", default_code_tables()));
  std::array<SymbolCounts, 2> counts{};
  counts[0][0] = 1000000;
  EXPECT_TRUE(fit("limited", code_tables(counts)));
}

TEST(CodeTables, AreTwiceAsManyWithOrientations) {
  constexpr Groups kTurning{.orientation = true};
  constexpr std::array<std::int32_t, 1> kRadii{50};
  const auto fit = [&](const std::vector<std::byte>& tables, const Groups& groups) {
    const CodecSetup setup{
        .name = "entropy", .capacity = 10, .tables = tables, .groups = groups, .radii = kRadii};
    return make_codec(setup).has_value();
  };
  EXPECT_TRUE(fit(default_code_tables(kTurning), kTurning));
  EXPECT_FALSE(fit(default_code_tables(), kTurning));
  EXPECT_FALSE(fit(default_code_tables(kTurning), {}));
  auto tables = default_code_tables(kTurning);
  tables[900] = std::byte{0};
  EXPECT_FALSE(fit(tables, kTurning));
}

}  // namespace
}  // namespace tandem
