#include "tests/bench/lab/scale/peers.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tandem::lab {
namespace {

const std::string kPrinted = R"(  10 of something
Loop time of 0.5 on 1 procs for 100 steps with 1000 atoms
80.0% CPU use with 1 MPI tasks x 1 OpenMP threads
     100   0.9    0
Loop time of 0.2 on 1 procs for 100 steps with 1000 atoms
100.0% CPU use with 1 MPI tasks x 1 OpenMP threads
atoms 1000
)";

TEST(Lammps, ItsTimesAreReadOfWhatItPrints) {
  const auto times = read_lammps(kPrinted, 2, 1000);
  ASSERT_TRUE(times) << times.error().message;
  EXPECT_DOUBLE_EQ(times->front().wall, 5000);
  EXPECT_DOUBLE_EQ(times->front().processor, 4000);
  EXPECT_DOUBLE_EQ(times->back().wall, 2000);
}

TEST(Lammps, ARunThatIsMissingOrAnAtomThatWasLostIsAnError) {
  EXPECT_FALSE(read_lammps(kPrinted, 3, 1000));
  EXPECT_FALSE(read_lammps(kPrinted, 2, 1001));
  EXPECT_FALSE(read_lammps("", 2, 1000));
}

}  // namespace
}  // namespace tandem::lab
