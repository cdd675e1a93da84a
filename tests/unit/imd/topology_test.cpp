#include "services/adapters/imd/topology.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <zlib.h>

#include <cstdio>
#include <random>
#include <string>
#include <vector>

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

std::string data(const std::string& hint, const std::string& rows, const std::string& more = "") {
  return "made by hand\n\n3 atoms\n2 atom types\n0 10 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n\n" + more +
         "Atoms" + hint + "\n\n" + rows;
}

TEST(ImdTopology, LammpsStylesAreGuessedWhereOneAloneFits) {
  const auto kinds = [](const std::string& rows) {
    const auto got = parse_topology(data("", rows), std::nullopt);
    return got ? got->kind_of : std::vector<std::uint16_t>{};
  };
  EXPECT_THAT(kinds("1 1 0.5 1 1\n2 2 1.5 2 2\n3 1 2 2 2\n"), ElementsAre(0, 1, 0));  // atomic
  EXPECT_THAT(kinds("1 1 0.5 1 1 0 0 -1\n2 2 1.5 2 2 0 0 0\n3 1 2 2 2 0 0 0\n"), ElementsAre(0, 1, 0));
  EXPECT_THAT(kinds("1 1 -0.5 1 1 1\n2 2 0.5 2 2 2\n3 1 0.1 2 2 2\n"), ElementsAre(0, 1, 0));  // charge
  EXPECT_THAT(kinds("1 1 1 1 1 1\n2 5 2 2 2 2\n3 6 1 2 2 2\n"), ElementsAre(0, 1, 0));         // molecular
  EXPECT_THAT(kinds("1 1 1 -0.8 1 1 1\n2 3 2 0.4 2 2 2\n3 3 2 0.4 2 2 2\n"), ElementsAre(0, 1, 1));  // full
  EXPECT_THAT(kinds("1 1 0.9 2.5 1 1 1\n2 2 0.8 2.5 2 2 2\n3 2 0.8 2.5 3 3 3\n"),
              ElementsAre(0, 1, 1));  // sphere
}

TEST(ImdTopology, LammpsStylesThatNobodyCanTellApartAreNamed) {
  const auto got =
      parse_topology(data("", "1 1 1 -0.8 1 1 1\n2 1 2 0.4 2 2 2\n3 1 2 0.4 2 2 2\n"), std::nullopt);
  ASSERT_FALSE(got);
  EXPECT_THAT(got.error().message,
              HasSubstr("which atom style? it may be full or sphere: write it behind the word Atoms"));
  EXPECT_EQ(
      parse_topology(data(" # full", "1 1 1 -0.8 1 1 1\n2 1 2 0.4 2 2 2\n3 1 2 0.4 2 2 2\n"), std::nullopt)
          ->kinds.size(),
      2U);
  const auto none = parse_topology(data("", "1 1 1\n2 1 1\n3 1 1\n"), std::nullopt);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message,
              HasSubstr("line 11: which atom style? none that is known here has such lines"));
}

TEST(ImdTopology, LammpsLabelsAreTypes) {
  const auto got = parse_topology(data(" # full", "1 1 C 0.1 1 1 1\n2 1 H 0.1 2 2 2\n3 1 2 0.1 2 2 2\n",
                                       "Atom Type Labels\n\n1 C\n2 H\n\nMasses\n\nC 12.0\nH 1.0 # x\n\n"),
                                  std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_THAT(got->kind_of, ElementsAre(0, 1, 1));
  EXPECT_EQ(got->kinds[0].name, "C");
  EXPECT_EQ(got->kinds[0].mass, 12);
  EXPECT_EQ(got->kinds[1].name, "H");
}

TEST(ImdTopology, GrainsOfAllSizesAreAFewKinds) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> diameters(0.8, 1.2);
  std::string text =
      "poly\n\n5000 atoms\n1 atom types\n0 60 xlo xhi\n0 60 ylo yhi\n0 60 zlo zhi\n\nAtoms # sphere\n\n";
  std::vector<double> radii;
  for (int i = 1; i <= 5000; ++i) {
    radii.push_back(diameters(random) / 2);
    text += std::to_string(i) + " 1 " + std::to_string(2 * radii.back()) + " 2.5 1 1 1\n";
  }
  const auto got = parse_topology(text, std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_LE(got->kinds.size(), 21U);
  for (std::size_t i = 0; i < radii.size(); ++i)
    EXPECT_NEAR(got->kinds[got->kind_of[i]].radius, radii[i], 0.0101 * radii[i]);
  EXPECT_THAT(got->note, HasSubstr("sizes, wrong by"));
  std::string table;
  for (int i = 0; i < 900; ++i) table += "1 grain" + std::to_string(i) + "\n";
  const auto many = parse_topology(table, std::nullopt);
  ASSERT_FALSE(many);
  EXPECT_THAT(many.error().message, HasSubstr("more than 800 kinds of atoms"));
}

TEST(ImdTopology, IonsOfAGroAreNoCarbons) {
  const auto got = parse_topology(
      "ions\n    5\n    1ALA     CA    1   0.126   0.624   1.679\n    2NA      NA    2   0.190   0.661   1.747\n"
      "    3CL      CL    3   0.177   0.568   1.613\n    4SOL     ZN    4   0.177   0.568   1.613\n"
      "    5BED      7    5   0.177   0.568   1.613\n   1.5 2.5 3.5\n",
      std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->kinds[0].name, "C");
  EXPECT_EQ(got->kinds[1].name, "Na");
  EXPECT_EQ(got->kinds[2].name, "Cl");
  EXPECT_EQ(got->kinds[3].name, "Zn");
  EXPECT_EQ(got->kinds[4].name, "7");
}

TEST(ImdTopology, PdbHasElementsOrNames) {
  const auto got = parse_topology(
      "CRYST1   30.000   40.000   50.000  90.00  90.00  90.00 P 1           1\n"
      "ATOM      1  CA  ALA A   1      11.104   6.134  -6.504  1.00  0.00           C\n"
      "HETATM    2 CA    CA A   2      11.104   6.134  -6.504  1.00  0.00\n"
      "ATOM      3  N   ALA A   1      11.104   6.134  -6.504\n"
      "ATOM      4 1HB  ALA A   1      11.104   6.134  -6.504\n"
      "ENDMDL\nATOM      1  CA  ALA A   1      11.104   6.134  -6.504  1.00  0.00           C\n",
      std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  ASSERT_EQ(got->kinds.size(), 4U);
  EXPECT_THAT(got->kind_of, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(got->kinds[0].name, "C");
  EXPECT_EQ(got->kinds[1].name, "Ca");
  EXPECT_EQ(got->kinds[2].name, "N");
  EXPECT_EQ(got->kinds[3].name, "H");
  EXPECT_THAT(*got->box, ElementsAre(30, 40, 50));
}

TEST(ImdTopology, XyzHasElements) {
  const auto got =
      parse_topology("3\nLattice=\"10 0 0 0 20 0 0 0 30\" x\nO 0 0 0\nH 1 0 0\nh 0 1 0\n", std::nullopt);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_THAT(got->kind_of, ElementsAre(0, 1, 1));
  EXPECT_EQ(got->kinds[1].radius, 1.2);
  EXPECT_THAT(*got->box, ElementsAre(10, 20, 30));
  EXPECT_TRUE(parse_topology("1\n7\nO 0 0 0\n", std::nullopt));  // its comment is no number of atoms
}

TEST(ImdTopology, CompressedFilesAreRead) {
  const std::string path = testing::TempDir() + "topology.data.gz";
  const gzFile file = gzopen(path.c_str(), "wb");
  gzputs(file, kData);
  gzclose(file);
  const auto got = read_topology(path, std::nullopt);
  std::remove(path.c_str());
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_THAT(got->kind_of, ElementsAre(0, 1, 1));
  EXPECT_FALSE(read_topology("/nowhere", std::nullopt));
}

TEST(ImdTopology, WhatIsWrongIsSaidWithTheLine) {
  const auto refused = [](const std::string& text, const char* line) {
    const auto got = parse_topology(text, std::nullopt);
    ASSERT_FALSE(got) << text;
    EXPECT_THAT(got.error().message, HasSubstr(line));
  };
  refused("", "no atoms");
  refused("3 grain 0.5\nfour grain\n", "line 2: expected COUNT");
  refused("data_1ABC\nATOM 1 N\n", "files that can be read are .gro, .pdb, .xyz and data files of LAMMPS");
  refused("ATOM      1  CA  ALA A   1\n", "line 1: an atom without coordinates");
  refused("3\ncomment\nO 0 0 0\nH 1 1\n", "line 4: expected ELEMENT X Y Z");
  refused("3 grain -1\n", "line 1: the radius");
  refused("3 grain 1 red\n", "line 1: the colour");
  refused("box 1 2 0\n", "line 1: a box");
  refused("5000000 grain\n", "more than 4194304 atoms");
  refused("title\n0\n", "number of atoms");
  refused("title\n2\n    1SOL     OW    1   0.126   0.624   1.679\n", "has 1 of its 2 atoms");
  refused("title\n1\nshort\n", "line 3: an atom without a name");
  refused("t\n\n2 atoms\n1 atom types\n\nAtoms\n\n1 1 0 0 0\n", "has 1 of its 2 atoms");
  refused("t\n\n1 atoms\n1 atom types\n\nAtoms # atomic\n\n1 2 0 0 0\n", "line 8: no atom of style atomic");
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
