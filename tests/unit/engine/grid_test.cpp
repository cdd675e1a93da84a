#include "services/engines/particles/grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace tandem::engine {
namespace {

constexpr std::uint64_t kSeed = 77;

struct Point {
  float x, y, z;
};

/// Points in the order of their places.
struct Sorted {
  Sorted(Grid& grid, const std::vector<Point>& points, std::uint32_t threads = 1)
      : by_place(points.size()), index(points.size()) {
    Workers workers(threads);
    std::vector<std::uint32_t> cells, places(points.size());
    for (const Point& p : points) cells.push_back(grid.cell_of(p.x, p.y, p.z));
    grid.arrange(cells, places, workers, threads);
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      by_place.at(places[i]) = points[i];
      index.at(places[i]) = i;
    }
  }
  std::vector<Point> by_place;
  std::vector<std::uint32_t> index;  ///< among the points given
};

std::vector<Point> random_points(std::uint32_t count, float extent) {
  std::mt19937_64 random(kSeed);
  const auto coordinate = [&] { return extent * (static_cast<float>(random() >> 40U) * 0x1p-23F - 1); };
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float x = coordinate(), y = coordinate();
    points.push_back({x, y, coordinate()});
  }
  return points;
}

void check_against_all_pairs(std::uint32_t count, float extent, std::uint32_t capacity) {
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " count " << count << " extent " << extent);
  Grid grid({-extent, -extent, -extent}, {extent, extent, extent}, 1, capacity);
  const Sorted sorted(grid, random_points(count, extent));
  ASSERT_EQ(grid.in_cells(), count);
  Rows rows;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Point& a = sorted.by_place[i];
    std::multiset<std::uint32_t> found;
    std::vector<std::uint32_t> places;
    Neighbourhood near;
    grid.look_around(grid.cell_of(a.x, a.y, a.z), rows, near);
    for (std::uint32_t r = 0; r < near.count; ++r) {
      for (std::uint32_t j = near.runs[r].begin; j < near.runs[r].end; ++j) places.push_back(j);
    }
    EXPECT_TRUE(std::is_sorted(places.begin(), places.end()));
    found.insert(places.begin(), places.end());
    for (std::uint32_t j = 0; j < count; ++j) {
      const Point& b = sorted.by_place[j];
      const float dx = a.x - b.x;
      const float dy = a.y - b.y;
      const float dz = a.z - b.z;
      if (dx * dx + dy * dy + dz * dz >= 0.99F) continue;
      ASSERT_EQ(found.count(j), 1U) << i << " and " << j;
    }
    ASSERT_EQ(std::set<std::uint32_t>(found.begin(), found.end()).size(), found.size()) << "nobody twice";
    const auto across = grid.across(grid.cell_of(a.x, a.y, a.z));
    ASSERT_EQ(std::set<std::uint32_t>(across.begin(), across.end()).size(), across.size());
  }
}

TEST(Grid, EveryCloseBodyIsInTheNeighbourhoodExactlyOnce) { check_against_all_pairs(2000, 6, 2000); }
TEST(Grid, AWorldFoldedOntoFewCellsMissesNobody) { check_against_all_pairs(1000, 20, 1000); }
TEST(Grid, BodiesOnTheBoundsAreFound) { check_against_all_pairs(400, 2, 400); }

TEST(Grid, AFullCellTurnsAwayTheLastAndKeepsThemBehindTheCells) {
  Grid grid({0, 0, 0}, {8, 8, 8}, 1, 300);
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < 300; ++i) points.push_back({i == 299 ? 7.5F : 0.5F, 0.5F, 0.5F});
  const Sorted sorted(grid, points);
  ASSERT_EQ(grid.in_cells(), kMaxInCell + 1);
  EXPECT_EQ(grid.size(), 300U);
  EXPECT_EQ(sorted.index[kMaxInCell - 1], kMaxInCell - 1);
  EXPECT_EQ(sorted.index[kMaxInCell], 299U);
  EXPECT_EQ(std::set<std::uint32_t>(sorted.index.begin(), sorted.index.end()).size(), 300U);
}

TEST(Grid, BodiesOfACellKeepTheirOrder) {
  Grid grid({0, 0, 0}, {8, 8, 8}, 1, 100);
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < 100; ++i) points.push_back({static_cast<float>(i % 7) + 0.5F, 0.5F, 0.5F});
  const Sorted sorted(grid, points);
  for (std::uint32_t i = 1; i < 100; ++i) {
    EXPECT_TRUE(sorted.by_place[i].x != sorted.by_place[i - 1].x || sorted.index[i - 1] < sorted.index[i]);
  }
}

TEST(Grid, ThreadsChangeNoPlace) {
  const std::vector<Point> points = random_points(5000, 9);
  Grid one({-9, -9, -9}, {9, 9, 9}, 1, 5000), three({-9, -9, -9}, {9, 9, 9}, 1, 5000);
  EXPECT_EQ(Sorted(one, points).index, Sorted(three, points, 3).index);
}

TEST(Grid, PlacesWithoutABodyAreLeftOut) {
  Grid grid({0, 0, 0}, {8, 8, 8}, 1, 300);
  Workers workers(1);
  std::vector<std::uint32_t> cells{grid.cell_of(5, 1, 1), kNoCell, grid.cell_of(1, 1, 1)}, places(3);
  grid.arrange(cells, places, workers, 1);
  EXPECT_EQ(places, (std::vector<std::uint32_t>{1, kNoPlace, 0}));
  EXPECT_EQ(grid.size(), 2U);
}

TEST(Grid, TakesOverAnOrderThatAscendsAndNoOther) {
  const std::vector<Point> points = random_points(500, 6);
  Grid made({-6, -6, -6}, {6, 6, 6}, 1, 500), other({-6, -6, -6}, {6, 6, 6}, 1, 500);
  const Sorted sorted(made, points);
  std::vector<std::uint32_t> cells;
  for (const Point& p : sorted.by_place) cells.push_back(made.cell_of(p.x, p.y, p.z));
  ASSERT_TRUE(other.adopt_order(cells));
  Rows rows;
  for (const std::uint32_t cell : cells) {
    Neighbourhood a, b;
    made.look_around(cell, rows, a);
    other.look_around(cell, rows, b);
    ASSERT_EQ(a.count, b.count);
    for (std::uint32_t r = 0; r < a.count; ++r) {
      ASSERT_EQ(a.runs[r].begin, b.runs[r].begin);
      ASSERT_EQ(a.runs[r].end, b.runs[r].end);
    }
  }
  std::reverse(cells.begin(), cells.end());
  EXPECT_FALSE(other.adopt_order(cells));
}

// Runs are copied to a buffer that has room for as many bodies as cells hold.
void expect_sound_runs(const Grid& grid, std::uint32_t places) {
  Rows rows;
  for (std::uint32_t cell = 0; cell < grid.cells(); ++cell) {
    Neighbourhood near;
    grid.look_around(cell, rows, near);
    std::uint32_t bodies = 0;
    for (std::uint32_t r = 0; r < near.count; ++r) {
      ASSERT_LE(near.runs[r].begin, near.runs[r].end) << "cell " << cell;
      ASSERT_LE(near.runs[r].end, places);
      bodies += near.runs[r].end - near.runs[r].begin;
    }
    ASSERT_LE(bodies, kMaxNeighbours) << "cell " << cell;
  }
}

TEST(Grid, PlacesThatDoNotCountLeaveRunsSound) {
  constexpr std::uint32_t kNotCounted = 600;
  Grid grid({0, 0, 0}, {8, 8, 8}, 1, 2000);
  for (const std::uint32_t last : {300U, grid.cells() - 1}) {
    std::vector<std::uint32_t> cells(3, kNoCell);
    cells.push_back(7);
    cells.insert(cells.end(), kNotCounted, kNoCell);
    cells.push_back(last);
    cells.insert(cells.end(), kNotCounted, kNoCell);
    ASSERT_TRUE(grid.adopt_order(cells));
    expect_sound_runs(grid, static_cast<std::uint32_t>(cells.size()));
    // Nothing of it is left after the next sort.
    Workers workers(1);
    std::vector<std::uint32_t> few{9, kNoCell, 200}, places(3);
    grid.arrange(few, places, workers, 1);
    expect_sound_runs(grid, 3);
  }
}

TEST(Grid, TakesOverNoOrderWithMoreBodiesInACellThanItHolds) {
  Grid grid({0, 0, 0}, {8, 8, 8}, 1, 2000);
  EXPECT_TRUE(grid.adopt_order(std::vector<std::uint32_t>(kMaxInCell, 5)));
  EXPECT_FALSE(grid.adopt_order(std::vector<std::uint32_t>(kMaxInCell + 1, 5)));
}

}  // namespace
}  // namespace tandem::engine
