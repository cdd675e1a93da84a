#include "tests/bench/lab/framerate/paper_numbers.hpp"

#include <gtest/gtest.h>

namespace tandem::lab {
namespace {

TEST(PaperNumbers, KnowThePapersTables) {
  EXPECT_EQ(paper_updates_per_s(1, 10000, "client-only"), 4.4);
  EXPECT_EQ(paper_updates_per_s(5, 10000, "limited"), 25.8);
  EXPECT_EQ(paper_updates_per_s(4, 5000, "client-only"), std::nullopt);
  EXPECT_EQ(paper_updates_per_s(1, 10000, "tracker"), std::nullopt);
  EXPECT_EQ(paper_framerate_users(3), 1U);
  EXPECT_EQ(paper_framerate_users(4), 4U);
  EXPECT_EQ(paper_framerate_users(0), std::nullopt);
}

}  // namespace
}  // namespace tandem::lab
