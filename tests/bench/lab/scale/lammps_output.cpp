#include <fmt/format.h>

#include <cstdio>
#include <sstream>

#include "tests/bench/lab/scale/peers.hpp"

namespace tandem::lab {

Result<std::vector<PileTime>> read_lammps(const std::string& printed, std::size_t runs,
                                          std::uint32_t bodies) {
  std::vector<PileTime> times;
  std::istringstream lines(printed);
  bool all_there = false;
  double share = 0;
  for (std::string line; std::getline(lines, line);) {
    double seconds = 0, steps = 0, atoms = 0;
    if (std::sscanf(line.c_str(), "Loop time of %lf on %*d procs for %lf steps with %lf atoms", &seconds,
                    &steps, &atoms) == 3 &&
        steps > 0 && atoms > 0) {
      const double ns = seconds * 1e9 / steps / atoms;
      times.push_back({ns, ns});
    } else if (line.find("% CPU use") != std::string::npos && !times.empty() &&
               std::sscanf(line.c_str(), "%lf", &share) == 1) {
      times.back().processor = times.back().wall * share / 100;
    } else if (line == fmt::format("atoms {}", bodies)) {
      all_there = true;
    }
  }
  if (times.size() != runs)
    return fail(ErrorCode::kIo, fmt::format("LAMMPS printed {} of {} runs", times.size(), runs));
  if (!all_there) return fail(ErrorCode::kIo, "LAMMPS lost atoms");
  return times;
}

}  // namespace tandem::lab
