#include "tandem/server_figures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace tandem {
namespace {

TEST(AServerFigure, IsListedByItsName) {
  std::vector<std::string> names;
  const ServerCounts figures;
  each_server_count([&names](const char* name, const auto&) { names.emplace_back(name); }, figures);
  EXPECT_EQ(std::count(names.begin(), names.end(), "refused_clients"), 1);
}

}  // namespace
}  // namespace tandem
