#include "services/engines/particles/strays.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace tandem::engine {
namespace {

Strays::Stray stray(std::uint32_t place, std::uint32_t cell) { return {1, 2, 3, 0.5F, place, cell}; }

// Rows of 128 cells. The one around whose cell `x` is looked for, and eight where nobody is.
std::vector<std::uint32_t> places_around(const Strays& strays, std::uint32_t row, std::uint32_t x) {
  Rows rows;
  for (std::uint32_t i = 0; i < 9; ++i) rows.first[i] = i == 4 ? row : (1000 + i) * 128;
  Strays::Runs runs;
  strays.look_around(rows, {(x - 1) % 128, x, (x + 1) % 128}, runs);
  std::vector<std::uint32_t> places;
  for (std::uint32_t i = 0; i < runs.count; ++i)
    for (std::uint32_t at = runs.runs[i].begin; at < runs.runs[i].end; ++at)
      places.push_back(strays.anchors().place[at]);
  std::sort(places.begin(), places.end());
  return places;
}

TEST(Strays, ThoseAroundACellAreFoundOnceAlsoAtTheEndsOfARow) {
  Strays strays(400);
  for (std::uint32_t place = 0; place < 384; ++place) strays.add(stray(place, place));
  strays.arrange();
  for (std::uint32_t x = 0; x < 128; ++x) {
    SCOPED_TRACE(x);
    std::vector<std::uint32_t> expected{128 + (x + 127) % 128, 128 + x, 128 + (x + 1) % 128};
    std::sort(expected.begin(), expected.end());
    // Others may share their buckets.
    const auto found = places_around(strays, 128, x);
    EXPECT_TRUE(std::includes(found.begin(), found.end(), expected.begin(), expected.end()));
    EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
    EXPECT_LT(found.size(), 200U);
  }
}

TEST(Strays, OneThatIsRemovedMakesRoomForAnother) {
  Strays strays(3);
  for (std::uint32_t place = 0; place < 3; ++place) EXPECT_EQ(strays.add(stray(place + 20, 5)), place);
  EXPECT_TRUE(strays.full());
  EXPECT_EQ(strays.remove(1), 22U);  // which has its number now
  EXPECT_EQ(strays[1].place, 22U);
  EXPECT_FALSE(strays.full());
  EXPECT_EQ(strays.add(stray(29, 64)), 2U);
  EXPECT_EQ(strays.remove(2), kNoPlace);
  strays.arrange();
  EXPECT_EQ(places_around(strays, 0, 5), (std::vector<std::uint32_t>{20, 22}));
}

TEST(Strays, NoneIsLeftAfterClearing) {
  Strays strays(3);
  strays.add(stray(0, 5));
  strays.arrange();
  strays.clear();
  EXPECT_EQ(strays.size(), 0U);
  EXPECT_TRUE(places_around(strays, 0, 5).empty());
}

}  // namespace
}  // namespace tandem::engine
