#include "services/engine/particles/strays.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace tandem::engine {
namespace {

Strays::Stray stray(std::uint32_t place, std::uint32_t cell) { return {1, 2, 3, 0.5F, place, cell, 0}; }

std::vector<std::uint32_t> places_in(const Strays& strays, std::uint32_t cell) {
  std::vector<std::uint32_t> places;
  strays.for_each(cell, [&](const Strays::Stray& s) { places.push_back(s.place); });
  std::sort(places.begin(), places.end());
  return places;
}

TEST(Strays, ACellHasThoseThatWereAddedWithIt) {
  Strays strays(100);
  for (std::uint32_t place = 0; place < 100; ++place) strays.add(stray(place, place % 7 * 1000));
  EXPECT_EQ(places_in(strays, 6000),
            (std::vector<std::uint32_t>{6, 13, 20, 27, 34, 41, 48, 55, 62, 69, 76, 83, 90, 97}));
  EXPECT_TRUE(places_in(strays, 6001).empty());
}

TEST(Strays, OneThatIsRemovedMakesRoomForAnother) {
  Strays strays(3);
  for (std::uint32_t place = 0; place < 3; ++place) strays.add(stray(place, 5));
  EXPECT_TRUE(strays.full());
  strays.remove(5, 1);
  EXPECT_FALSE(strays.full());
  strays.add(stray(9, 64));
  EXPECT_TRUE(strays.full());
  EXPECT_EQ(places_in(strays, 5), (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(places_in(strays, 64), std::vector<std::uint32_t>{9});
}

TEST(Strays, NoneIsLeftAfterClearing) {
  Strays strays(3);
  strays.add(stray(0, 5));
  strays.clear();
  EXPECT_TRUE(places_in(strays, 5).empty());
  EXPECT_FALSE(strays.full());
}

}  // namespace
}  // namespace tandem::engine
