#include "tests/bench/lab/scale/chart.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace tandem::lab {
namespace {

TEST(Chart, TheSlopeOfAPowerIsItsExponent) {
  EXPECT_NEAR(log_slope({{1, 3}, {10, 30}, {100, 300}}), 1, 1e-12);
  EXPECT_NEAR(log_slope({{2, 4}, {4, 16}, {8, 64}}), 2, 1e-12);
}

TEST(Chart, PointsThatALogarithmLacksDoNotCount) {
  EXPECT_NEAR(log_slope({{1, 5}, {10, 0}, {100, 500}}), 1, 1e-12);
  EXPECT_EQ(log_slope({{1, 5}}), 0);
  EXPECT_EQ(log_slope({}), 0);
}

TEST(Chart, EachLineIsDrawnUnderItsName) {
  const std::string path = ::testing::TempDir() + "/tandem_chart_test.svg";
  ASSERT_TRUE(draw_chart(path, "a & b", "bodies", "ms", {{"step", {{10, 1}, {100, 12}}}, {"none", {}}}));
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(text.find("a &amp; b"), std::string::npos);
  EXPECT_NE(text.find(">step (slope 1.08)<"), std::string::npos);
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.find("inf"), std::string::npos);
  std::filesystem::remove(path);
}

TEST(Chart, AFileThatCannotBeWrittenIsAnError) {
  EXPECT_FALSE(draw_chart("/nowhere/at/all.svg", "", "", "", {}));
}

}  // namespace
}  // namespace tandem::lab
