#include "services/adapters/lammps/facts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <sstream>

namespace tandem_lammps {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

/// LAMMPS does that for the program.
Words split(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), {}};
}

Facts of(std::initializer_list<const char*> lines) {
  Facts facts;
  for (const char* line : lines) facts.learn(split(line));
  return facts;
}

constexpr Box kBox{.low = {-1, -2, -3}, .high = {4, 5, 6}, .periodic = {}};

TEST(LammpsFacts, GravityIsReadInItsThreeForms) {
  const auto vector = Facts::gravity_of(split("fix g all gravity 10 vector 0 3 -4"), false);
  ASSERT_TRUE(vector);
  EXPECT_THAT(vector->value, ElementsAre(0, DoubleNear(6, 1e-12), DoubleNear(-8, 1e-12)));
  EXPECT_EQ(vector->fix, "g");
  EXPECT_EQ(vector->group, "all");
  const auto chute = Facts::gravity_of(split("fix g all gravity 1 chute 30"), false);
  ASSERT_TRUE(chute);
  EXPECT_THAT(chute->value, ElementsAre(DoubleNear(0.5, 1e-12), 0, DoubleNear(-std::sqrt(0.75), 1e-12)));
  const auto spherical = Facts::gravity_of(split("fix g all gravity 2 spherical 0 180"), false);
  ASSERT_TRUE(spherical);
  EXPECT_THAT(spherical->value,
              ElementsAre(DoubleNear(0, 1e-12), DoubleNear(0, 1e-12), DoubleNear(-2, 1e-12)));
}

TEST(LammpsFacts, AGravityThatVariesBelongsToTheScript) {
  EXPECT_FALSE(Facts::gravity_of(split("fix g all gravity v_g vector 0 0 -1"), false));
  EXPECT_FALSE(Facts::gravity_of(split("fix g all gravity 1 vector 0 0 v_z"), false));
  EXPECT_FALSE(Facts::gravity_of(split("fix g all gravity 1 vector 0 0 0"), false));
  EXPECT_FALSE(Facts::gravity_of(split("fix g all gravity 1"), false));
  EXPECT_FALSE(Facts::gravity_of(split("fix g all nve"), false));
}

TEST(LammpsFacts, WallsArePlanesThatPointInwards) {
  const auto planes = of({"fix z all wall/gran hooke 2000 NULL 20 NULL 0.5 1 zplane 0 NULL",
                          "fix x all wall/reflect xlo EDGE xhi 3.5"})
                          .planes(kBox);
  ASSERT_EQ(planes.size(), 3U);
  EXPECT_THAT(planes[0].normal, ElementsAre(1, 0, 0));
  EXPECT_EQ(planes[0].offset, -1);
  EXPECT_THAT(planes[1].normal, ElementsAre(-1, 0, 0));
  EXPECT_EQ(planes[1].offset, -3.5);
  EXPECT_THAT(planes[2].normal, ElementsAre(0, 0, 1));
  EXPECT_EQ(planes[2].offset, 0);
}

TEST(LammpsFacts, WallsOfRegionsAndTheirEnd) {
  EXPECT_EQ(
      of({"region r block -1 1 -2 2 -3 INF", "fix w all wall/region r harmonic 1 0 1"}).planes(kBox).size(),
      5U);
  const auto ball =
      of({"region s sphere 1 2 3 4 side out", "fix w all wall/gran/region hooke 1 NULL 1 NULL 1 1 region s"})
          .balls();
  ASSERT_EQ(ball.size(), 1U);
  EXPECT_THAT(ball[0], ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(of({"fix z all wall/gran hooke 1 NULL 1 NULL 1 1 zplane 0 1", "unfix z"}).planes(kBox).empty());
}

TEST(LammpsFacts, PoursSayTheRadiiOfGrainsToCome) {
  const Facts facts = of({"fix p all pour 100 2 4767 region r diam range 0.8 1.2",
                          "fix q all pour 10 1 99 region r diam poly 2 0.5 0.7 0.9 0.3",
                          "fix d all deposit 9 3 5 99 region r"});
  EXPECT_TRUE(facts.pours());
  ASSERT_TRUE(facts.poured(2));
  EXPECT_EQ(facts.poured(2)->least, 0.4);
  EXPECT_EQ(facts.poured(2)->most, 0.6);
  ASSERT_TRUE(facts.poured(1));
  EXPECT_EQ(facts.poured(1)->least, 0.25);
  EXPECT_EQ(facts.poured(1)->most, 0.45);
  ASSERT_TRUE(facts.poured(3));
  EXPECT_EQ(facts.poured(3)->most, 0.5);
  EXPECT_FALSE(of({"fix d all deposit 10 1 5 99 region r"}).pours());
}

TEST(LammpsFacts, TheLawAndTheSizeOfAtomsComeFromThePairStyle) {
  const auto law = of({"pair_style gran/hooke 2000 NULL 20 NULL 0.5 1"}).law();
  ASSERT_TRUE(law);
  EXPECT_EQ(law->spring, 2000);
  EXPECT_EQ(law->damping, 20);
  EXPECT_EQ(law->shear, 10);
  EXPECT_FALSE(of({"pair_style lj/cut 2.5"}).law());
  const Facts melt = of({"pair_style lj/cut 2.5", "pair_coeff 2 2 1.0 3.4 8.5"});
  EXPECT_EQ(melt.sigma_radius(2), 1.7);
  EXPECT_FALSE(melt.sigma_radius(1));
}

TEST(LammpsFacts, ATypeWithoutSigmaIsHalfOfTheSmallestOther) {
  const Facts water =
      of({"pair_style lj/cut/coul/long 10", "pair_coeff * * 0 0", "pair_coeff 1 1 0.1553 3.166"});
  EXPECT_EQ(water.sigma_radius(1), 1.583);
  EXPECT_EQ(water.sigma_radius(2), 1.583 / 2);
  EXPECT_FALSE(of({"pair_style lj/cut 2.5", "pair_coeff * * 0 0"}).sigma_radius(1));
}

TEST(LammpsFacts, HalfALineTeachesNothing) {
  for (const char* line :
       {"fix", "fix a", "fix a all", "fix a all pour", "fix a all pour 1 2 3 diam",
        "fix a all wall/gran zplane 0", "fix a all pour 1 2 3 diam poly 99999999999 1", "region",
        "region a block", "region a block 1 2", "unfix", "region a plane 0 0 0 0 0 0", "pair_style",
        "pair_coeff 1", "fix a all wall/gran/region nothing", "\"", ""})
    EXPECT_TRUE(of({line}).planes(kBox).empty()) << line;
}

}  // namespace
}  // namespace tandem_lammps
