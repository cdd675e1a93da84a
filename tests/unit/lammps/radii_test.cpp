#include "services/adapters/lammps/radii.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tandem_lammps {
namespace {

TEST(LammpsRadii, AllSizesAreAFewThatAreWrongByOnePercent) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (const double most : {0.8000001, 0.81, 1.2, 800.0}) {
    const RadiusClasses classes(0.8, most, kMaxTypes);
    EXPECT_LE(classes.error(), 0.01);
    EXPECT_LE(classes.count(), 350U);
    std::uniform_real_distribution<double> radii(0.8, most);
    for (int i = 0; i < 1000; ++i) {
      const double radius = radii(random);
      ASSERT_LT(classes.index_of(radius), classes.count());
      EXPECT_NEAR(classes.radius(classes.index_of(radius)), radius, 0.01001 * radius);
    }
  }
}

TEST(LammpsRadii, FewClassesAreWrongByMore) {
  const RadiusClasses classes(1, 2, 4);
  EXPECT_EQ(classes.count(), 4U);
  EXPECT_NEAR(classes.error(), 0.0905, 1e-4);
  EXPECT_EQ(classes.index_of(0), 0U);
  EXPECT_EQ(classes.index_of(99), 3U);
}

TEST(LammpsRadii, OneSizeIsOneClass) {
  const RadiusClasses classes(0.5, 0.5, kMaxTypes);
  EXPECT_EQ(classes.count(), 1U);
  EXPECT_EQ(classes.radius(0), 0.5);
  EXPECT_EQ(classes.index_of(0.5), 0U);
}

}  // namespace
}  // namespace tandem_lammps
