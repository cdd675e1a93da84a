#include <gtest/gtest.h>

#include "services/host/planning/plan.hpp"

namespace tandem::planning {
namespace {

TEST(ANewStreamOption, IsReadByItsKeyAndTakesEffect) {
  const auto stream = read_stream("fine:min-error=0.001");
  ASSERT_TRUE(stream.has_value()) << stream.error().message;
  Wishes wishes;
  wishes.automatic = true;
  const auto whole = wishes_of(wishes, *stream);
  ASSERT_TRUE(whole.has_value()) << whole.error().message;
  EXPECT_EQ(whole->min_error_m, 0.001);
  const PlannedWorld world{
      .name = "balls", .capacity = 1000, .dt_s = 1.0 / 60, .extent = 20, .threshold = 0.02};
  EXPECT_TRUE(plan_stream(world, *whole).has_value());
}

}  // namespace
}  // namespace tandem::planning
