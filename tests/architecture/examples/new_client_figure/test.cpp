#include "tandem/client_figures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace tandem {
namespace {

TEST(AClientFigure, IsListedByItsName) {
  std::vector<std::string> names;
  const ClientFigures figures;
  each_client_figure([&names](const char* name, const auto&) { names.emplace_back(name); }, figures);
  EXPECT_EQ(std::count(names.begin(), names.end(), "snapshot_bytes"), 1);
}

}  // namespace
}  // namespace tandem
