#include "services/adapters/lammps/recorded.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace tandem_lammps {
namespace {

using testing::ElementsAre;

TEST(LammpsRecorded, WhatALaterCommandUndoesOrReplacesIsForgotten) {
  Recorded recorded;
  for (const Words& words : {Words{"timestep", "1"},
                             {"pair_style", "soft", "1"},
                             {"pair_coeff", "*", "*", "10"},
                             {"fix", "a", "all", "nve"},
                             {"fix", "b", "all", "langevin"},
                             {"fix_modify", "b", "temp", "t"},
                             {"pair_style", "lj/cut", "2.5"},
                             {"pair_coeff", "1", "1", "1", "1"},
                             {"unfix", "b"},
                             {"run", "100"},
                             {"fix", "a", "all", "nvt"},
                             {"group", "g", "type", "1"},
                             {"timestep", "2"}})
    recorded.add(words);
  EXPECT_THAT(recorded.lines(),
              ElementsAre(Words{"fix", "a", "all", "nve"}, Words{"pair_style", "lj/cut", "2.5"},
                          Words{"pair_coeff", "1", "1", "1", "1"}, Words{"fix", "a", "all", "nvt"},
                          Words{"timestep", "2"}));
  recorded.add({"clear"});
  EXPECT_TRUE(recorded.lines().empty());
}

TEST(LammpsRecorded, ALoopMakesNoListWithoutEnd) {
  Recorded recorded;
  for (int i = 0; i < 1000; ++i) {
    recorded.add({"variable", "i", "loop", "1000"});
    recorded.add({"variable", "t", "equal", std::to_string(i)});
    recorded.add({"fix", "a", "all", "nvt", std::to_string(i)});
    recorded.add({"lattice", "fcc", "0.8"});
    recorded.add({"pair_coeff", "1", "1", "1"});
  }
  EXPECT_LT(recorded.lines().size(), 10U);
  EXPECT_EQ(recorded.lines().back()[0], "pair_coeff");
}

TEST(LammpsRecorded, CoefficientsOfADataFileComeWithTheAtoms) {
  Recorded recorded;
  recorded.add({"pair_style", "lj/cut", "10"});
  recorded.add({"bond_style", "harmonic"});
  EXPECT_TRUE(recorded.comes_with_atoms({"pair_style", "lj/cut", "10"}));
  EXPECT_TRUE(recorded.comes_with_atoms({"bond_style", "harmonic"}));
  recorded.add({"pair_coeff", "1", "1", "1"});
  EXPECT_FALSE(recorded.comes_with_atoms({"pair_style", "lj/cut", "10"}));
  EXPECT_FALSE(recorded.comes_with_atoms({"bond_style", "hybrid", "harmonic"}));
  EXPECT_FALSE(recorded.comes_with_atoms({"pair_coeff", "1", "1", "1"}));
}

TEST(LammpsRecorded, SomeCommandsComeBeforeTheAtoms) {
  for (const Words& words :
       {Words{"atom_modify", "map", "array"}, {"molecule", "m", "f"}, {"kim", "init", "m", "metal"}})
    EXPECT_TRUE(Recorded::comes_before_atoms(words)) << words[0];
  for (const Words& words : {Words{"pair_style", "lj/cut"}, {"kim", "interactions", "Ar"}, {}})
    EXPECT_FALSE(Recorded::comes_before_atoms(words));
}

TEST(LammpsRecorded, WordsAreQuotedWhereLammpsNeedsIt) {
  EXPECT_EQ(joined({"print", "a b", "", "c#d", "$x", "say \"no\"", "it's \"so\" ", "two\nlines"}),
            "print \"a b\" \"\" \"c#d\" \"$x\" 'say \"no\"' \"\"\"it's \"so\" \"\"\" \"\"\"two\nlines\"\"\"");
}

}  // namespace
}  // namespace tandem_lammps
