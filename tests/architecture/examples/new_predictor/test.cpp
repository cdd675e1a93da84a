#include <gtest/gtest.h>

#include "sdk/core/tables/predictor_table.hpp"

namespace tandem {
namespace {

TEST(ANewPredictor, IsMadeByItsNameAndSteps) {
  const auto coast = make_predictor("coast", 4, {});
  ASSERT_TRUE(coast.has_value()) << coast.error().message;
  State state(4);
  state.alive()[1] = 1;
  StepInput input;
  input.drive.gravity = {0, 0, -64};
  (*coast)->step(state, state, input);
  EXPECT_EQ(state.v(2)[1], -64);
  EXPECT_EQ(state.p(2)[1], -1);
  EXPECT_EQ(state.p(2)[0], 0) << "nobody is in slot 0";
}

}  // namespace
}  // namespace tandem
