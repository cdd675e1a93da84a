// The deepest pile decides about stability: contacts at its bottom are many and strong.
#include <algorithm>
#include <cstddef>
#include <vector>

#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

double median_speed(const Simulation& s) {
  std::vector<double> squares;
  for (std::uint32_t slot = 0; slot < s.capacity(); ++slot) {
    const Vec3 v = velocity(s, slot);
    squares.push_back(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle);
}

TEST(DeepPile, APileOf10000ComesToRest) {
  EngineWorld world = pile_world(10000, 9);
  world.dt_s = 1.0F / 60;
  const auto s = make(world, 2);
  for (int frame = 0; frame < 2400; ++frame) s->step();
  EXPECT_LT(rms_speed(*s), 0.02);  // 2 % of a diameter a second; what is left is a creep that goes on slowing
  EXPECT_EQ(s->colliding(), 10000U);
}

// The steps of 1/30 s are at the limit of stability this deep: a hundred bodies at the bottom go on shaking
// at up to 2 m/s, others in each start. How many, and so the mean square, is chaos.
TEST(DeepPile, AlsoInLongStepsMostBodiesComeToRest) {
  const auto s = make(pile_world(10000, 9), 2);
  for (int frame = 0; frame < 1200; ++frame) s->step();
  EXPECT_LT(median_speed(*s), 0.02);
  EXPECT_LT(rms_speed(*s), 0.1);  // a pile that boils has more than 1
  EXPECT_EQ(s->colliding(), 10000U);
}

}  // namespace
}  // namespace tandem::engine
