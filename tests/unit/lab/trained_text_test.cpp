#include "tests/bench/lab/trained_text.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace tandem::lab {
namespace {

TEST(TrainedText, IsReadAsTheTablesThatItHas) {
  const std::vector<scenes::TrainedTable> tables{{.bodies = 5000,
                                                  .threshold_m = 0.05,
                                                  .position_range_m = 0.1,
                                                  .velocity_range_m_per_s = 1.0 / 3,
                                                  .position_code_lengths = {1, 2, 64},
                                                  .velocity_code_lengths = {0, 1},
                                                  .turn_range_rad = 1e-7,
                                                  .spin_range_rad_per_s = 20,
                                                  .turn_code_lengths = {3},
                                                  .spin_code_lengths = {4, 4}},
                                                 {.bodies = 10000,
                                                  .threshold_m = 0.01,
                                                  .position_range_m = 0,
                                                  .velocity_range_m_per_s = 2,
                                                  .position_code_lengths = {},
                                                  .velocity_code_lengths = {}}};
  const std::string scene = ::testing::TempDir() + "/tandem_trained_text_test.textproto";
  const std::string path = scenes::trained_path(scene);
  std::ofstream(path) << trained_text(tables);
  const auto read = scenes::load_trained(scene);
  std::filesystem::remove(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, tables);
}

TEST(TrainedText, ATableTakesThePlaceOfItsLikeAlone) {
  scenes::TrainedTable table;
  table.bodies = 5000;
  table.threshold_m = 0.05;
  std::vector<scenes::TrainedTable> tables;
  put(tables, table);
  table.bodies = 10000;
  put(tables, table);
  table.bodies = 5000;
  table.position_range_m = 1;
  put(tables, table);
  ASSERT_EQ(tables.size(), 2U);
  EXPECT_EQ(tables[0].position_range_m, 1);
  EXPECT_EQ(tables[1].bodies, 10000U);
}

}  // namespace
}  // namespace tandem::lab
