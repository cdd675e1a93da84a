#pragma once
// `bench_lab scale --peers`: this engine, LAMMPS and Bullet with the same pile on one core.

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::lab {

struct PileSetup {
  std::uint32_t bodies = 0;
  std::uint64_t steps = 120;   ///< measured, of each state
  std::uint64_t settle = 600;  ///< steps between the two states
  std::vector<std::uint32_t> threads{1};
  const std::atomic<bool>* stop = nullptr;
};

/// Nanoseconds a body and step.
struct PileTime {
  double processor = 0;  ///< of all threads
  double wall = 0;
};

struct PileRow {
  std::string engine;
  std::uint32_t threads = 1;
  std::string not_run;       ///< why; empty: it was run
  PileTime moving, settled;  ///< mean of the steps
  PileTime asleep;           ///< 0: not measured
};

/// Runs the pile in each engine, one after the other. What is not installed has a row that says so. Errors:
/// kInvalidArgument, kIo (LAMMPS failed or lost an atom; stopped).
[[nodiscard]] Result<std::vector<PileRow>> measure_piles(const PileSetup& setup);

/// What LAMMPS printed of its runs: mean processor and wall time of each. Errors: kIo if there are not `runs`
/// of them, or `bodies` atoms at the end.
[[nodiscard]] Result<std::vector<PileTime>> read_lammps(const std::string& printed, std::size_t runs,
                                                        std::uint32_t bodies);

}  // namespace tandem::lab
