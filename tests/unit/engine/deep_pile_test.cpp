// The deepest pile decides about stability: contacts at its bottom are many and strong.
#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

TEST(DeepPile, APileOf10000ComesToRest) {
  const auto s = make(pile_world(10000, 9), 2);
  for (int frame = 0; frame < 1200; ++frame) s->step();
  // This deep, contacts are at the limit of stability, and what is left is chaos: moving one body by 1 mm at
  // the start gives 0.013 to 0.06 of a diameter a second. A pile that boils has more than 1.
  EXPECT_LT(rms_speed(*s), 0.1);
  EXPECT_EQ(s->colliding(), 10000U);
}

}  // namespace
}  // namespace tandem::engine
