#include "services/engine/particles/grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace tandem::engine {
namespace {

constexpr std::uint64_t kSeed = 77;

void check_against_all_pairs(std::uint32_t count, float extent, std::uint32_t capacity) {
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " count " << count << " extent " << extent);
  const Vec3f low{-extent, -extent, -extent};
  const Vec3f high{extent, extent, extent};
  Grid grid(low, high, 1, capacity);
  std::mt19937_64 random(kSeed);
  const auto coordinate = [&] { return extent * (static_cast<float>(random() >> 40U) * 0x1p-23F - 1); };
  std::vector<Record> bodies;
  for (std::uint32_t i = 0; i < count; ++i)
    bodies.push_back({coordinate(), coordinate(), coordinate(), 0.5F, 0, 0, 0, i});
  grid.sort(bodies);
  ASSERT_EQ(grid.sorted().size(), count);
  for (const Record& a : grid.sorted()) {
    std::multiset<std::uint32_t> found;
    const Neighbourhood near = grid.neighbourhood(grid.cell_of(a.x, a.y, a.z));
    for (std::uint32_t r = 0; r < near.count; ++r) {
      for (std::uint32_t j = near.runs[r].begin; j < near.runs[r].end; ++j)
        found.insert(grid.sorted()[j].slot);
    }
    for (const Record& b : bodies) {
      const float dx = a.x - b.x;
      const float dy = a.y - b.y;
      const float dz = a.z - b.z;
      if (dx * dx + dy * dy + dz * dz >= 0.99F) continue;
      ASSERT_EQ(found.count(b.slot), 1U) << a.slot << " and " << b.slot;
    }
    ASSERT_EQ(std::set<std::uint32_t>(found.begin(), found.end()).size(), found.size()) << "nobody twice";
  }
}

TEST(Grid, EveryCloseBodyIsInTheNeighbourhoodExactlyOnce) { check_against_all_pairs(2000, 6, 2000); }
TEST(Grid, AWorldFoldedOntoFewCellsMissesNobody) { check_against_all_pairs(1000, 20, 1000); }
TEST(Grid, BodiesOnTheBoundsAreFound) { check_against_all_pairs(400, 2, 400); }

TEST(Grid, AFullCellTurnsAwayTheLastAndKeepsThemBehindTheCells) {
  Grid grid({0, 0, 0}, {8, 8, 8}, 1, 300);
  std::vector<Record> bodies;
  for (std::uint32_t i = 0; i < 300; ++i)
    bodies.push_back({i == 299 ? 7.5F : 0.5F, 0.5F, 0.5F, 0.5F, 0, 0, 0, i});
  grid.sort(bodies);
  ASSERT_EQ(grid.in_cells(), kMaxInCell + 1);
  EXPECT_EQ(grid.sorted()[kMaxInCell - 1].slot, kMaxInCell - 1);
  EXPECT_EQ(grid.sorted()[kMaxInCell].slot, 299U);
  std::set<std::uint32_t> slots;
  for (const Record& body : grid.sorted()) slots.insert(body.slot);
  EXPECT_EQ(slots.size(), 300U);
}

TEST(Grid, NeighboursComeByAscendingPlaceAndLaterRowsAloneMissNoLaterBody) {
  Grid grid({-4, -4, -4}, {4, 4, 4}, 1, 1000);
  std::mt19937_64 random(kSeed);
  std::vector<Record> bodies;
  const auto coordinate = [&] { return static_cast<float>(random() >> 40U) * 0x1p-21F - 4; };
  for (std::uint32_t i = 0; i < 1000; ++i)
    bodies.push_back({coordinate(), coordinate(), coordinate(), 0.5F, 0, 0, 0, i});
  grid.sort(bodies);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Record& body = grid.sorted()[i];
    const auto later = [&](bool later_only) {
      std::vector<std::uint32_t> places;
      const Neighbourhood around = grid.neighbourhood(grid.cell_of(body.x, body.y, body.z), later_only);
      for (std::uint32_t r = 0; r < around.count; ++r) {
        for (std::uint32_t j = std::max(around.runs[r].begin, i + 1); j < around.runs[r].end; ++j)
          places.push_back(j);
      }
      return places;
    };
    EXPECT_EQ(later(false), later(true));
    const std::vector<std::uint32_t> places = later(false);
    EXPECT_TRUE(std::is_sorted(places.begin(), places.end()));
  }
}

TEST(Grid, BodiesOfACellKeepTheirOrder) {
  Grid grid({0, 0, 0}, {8, 8, 8}, 1, 100);
  std::vector<Record> bodies;
  for (std::uint32_t i = 0; i < 100; ++i) {
    bodies.push_back({static_cast<float>(i % 7) + 0.5F, 0.5F, 0.5F, 0.5F, 0, 0, 0, i});
  }
  grid.sort(bodies);
  std::uint32_t previous_cell = UINT32_MAX;
  std::uint32_t previous_slot = 0;
  for (const Record& body : grid.sorted()) {
    const std::uint32_t cell = grid.cell_of(body.x, body.y, body.z);
    EXPECT_TRUE(cell != previous_cell || previous_slot < body.slot);
    previous_cell = cell;
    previous_slot = body.slot;
  }
}

}  // namespace
}  // namespace tandem::engine
