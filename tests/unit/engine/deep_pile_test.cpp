// The deepest pile decides about stability: contacts at its bottom are many and strong.
#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

TEST(DeepPile, APileOf10000ComesToRest) {
  const auto s = make(pile_world(10000, 9), 2);
  for (int frame = 0; frame < 1200; ++frame) s->step();
  EXPECT_LT(rms_speed(*s), 0.02);  // 2 % of a diameter a second; what is left is a creep that goes on slowing
  EXPECT_EQ(s->colliding(), 10000U);
}

}  // namespace
}  // namespace tandem::engine
