#include "services/imd/topology.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace tandem::imd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kGro =
    "Water\n    4\n    1SOL     OW    1   0.126   0.624   1.679\n    1SOL    HW1    2   0.190   0.661   1.747\n"
    "    1SOL    HW2    3   0.177   0.568   1.613\n    2ION     2X    4   1.275   0.053   0.622\n   1.5 2.5 3.5\n";
constexpr const char* kData =
    "made by hand\n\n3 atoms\n2 atom types\n0 10 xlo xhi\n-5 5 ylo yhi\n0 20 zlo zhi\n\nMasses\n\n1 12.0\n2 1.0\n\n"
    "Atoms # sphere\n\n30 2 1.0 2.5 1 1 1\n10 1 3.0 2.5 2 2 2\n20 2 1.0 2.5 3 3 3\n\nVelocities\n\n30 0 0 0 0 0 0\n";

TEST(ImdTopology, LinesOfOurOwn) {
  const auto got =
      parse_topology("# a test\n3 grain 0.5 FF0000FF 2\n2 stone # by default\nbox 10 20 30\n", std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_THAT(got->kind_of, ElementsAre(0, 0, 0, 1, 1));
  EXPECT_EQ(got->kinds[0].name, "grain");
  EXPECT_EQ(got->kinds[0].colour_rgba, 0xFF0000FF);
  EXPECT_EQ(got->kinds[0].mass, 2);
  EXPECT_EQ(got->kinds[1].radius, 0.5);
  EXPECT_THAT(*got->box, ElementsAre(10, 20, 30));
}

TEST(ImdTopology, GromacsNamesAreElementsAndNanometresAngstrom) {
  const auto got = parse_topology(kGro, std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_THAT(got->kind_of, ElementsAre(0, 1, 1, 2));
  EXPECT_EQ(got->kinds[0].name, "O");
  EXPECT_EQ(got->kinds[0].radius, 1.52);
  EXPECT_EQ(got->kinds[2].name, "X");
  EXPECT_THAT(*got->box, ElementsAre(15, 25, 35));
  EXPECT_EQ(parse_topology(kGro, 0.25)->kinds[0].radius, 0.25);
}

TEST(ImdTopology, LammpsAtomsAreOrderedByTheirIds) {
  const auto got = parse_topology(kData, std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_THAT(got->kind_of, ElementsAre(0, 1, 1));  // ids 10, 20, 30
  EXPECT_EQ(got->kinds[0].name, "type1");
  EXPECT_EQ(got->kinds[0].radius, 1.5);
  EXPECT_EQ(got->kinds[0].mass, 12);
  EXPECT_THAT(*got->box, ElementsAre(10, 10, 20));
}

TEST(ImdTopology, WhatIsWrongIsSaidWithTheLine) {
  const auto refused = [](const std::string& text, const char* line) {
    const auto got = parse_topology(text, std::nullopt);
    ASSERT_FALSE(got) << text;
    EXPECT_THAT(got.error().message, HasSubstr(line));
  };
  refused("", "no atoms");
  refused("3 grain 0.5\nfour grain\n", "line 2: expected COUNT");
  refused("3 grain -1\n", "line 1: the radius");
  refused("3 grain 1 red\n", "line 1: the colour");
  refused("box 1 2 0\n", "line 1: a box");
  refused("5000000 grain\n", "more than 4194304 atoms");
  refused("title\n0\n", "number of atoms");
  refused("title\n2\n    1SOL     OW    1   0.126   0.624   1.679\n", "has 1 of its 2 atoms");
  refused("title\n1\nshort\n", "line 3: an atom without a name");
  refused("t\n\n2 atoms\n1 atom types\n\nAtoms\n\n1 1 0 0 0\n", "has 1 of its 2 atoms");
  refused("t\n\n1 atoms\n1 atom types\n\nAtoms\n\n1 2 0 0 0\n", "line 8: no atom of style atomic");
  refused("t\n\n1 atoms\n1 atom types\n\nAtoms # tdpd\n", "atom style tdpd");
}

TEST(ImdTopology, GarbageIsRefusedOrRead) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (int i = 0; i < 2000; ++i) {
    std::string text = i % 2 == 0 ? kGro : kData;
    for (auto n = 1 + random() % 5; n > 0; --n)
      text[random() % text.size()] = static_cast<char>(random() % 128);
    const auto got = parse_topology(text, std::nullopt);
    if (!got) continue;
    for (const std::uint16_t kind : got->kind_of) ASSERT_LT(kind, got->kinds.size());
    for (const Kind& kind : got->kinds) EXPECT_GT(kind.radius, 0);
  }
}

}  // namespace
}  // namespace tandem::imd
