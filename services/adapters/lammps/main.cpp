// SPDX-License-Identifier: MIT
// tandem-lammps: runs a LAMMPS script on any number of MPI ranks, as an engine of a Tandem server
// (idl/ENGINE.md).

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "services/adapters/lammps/lammps.hpp"
#include "services/adapters/lammps/screen.hpp"
#include "services/adapters/lammps/stage.hpp"

namespace {

using namespace tandem_lammps;

int run(const LammpsOptions& options, const Ranks& ranks) {
  std::vector<std::string> words{"tandem-lammps", "-log", "none"};
  words.insert(words.end(), options.for_lammps.begin(), options.for_lammps.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  // The library keeps the arguments only while it opens.
  void* const lammps =
      lammps_open(static_cast<int>(arguments.size()), arguments.data(), ranks.comm(), nullptr);
  int exit_code = 1;
  try {
    Stage stage(lammps, ranks, options);
    exit_code = stage.play();
  } catch (const Refusal& refusal) {
    if (ranks.first()) std::fprintf(stderr, "tandem-lammps: %s\n", refusal.why.c_str());
  }
  lammps_close(lammps);
  return exit_code;
}

/// --help needs no MPI. Of several ranks, the launcher's variables name the first one before MPI does.
bool is_first_by_environment() {
  for (const char* const name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "SLURM_PROCID"})
    if (const char* const rank = std::getenv(name)) return std::string(rank) == "0";
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  LammpsOptions options;
  if (const auto exit_code = parse(argc, argv, is_first_by_environment(), options)) return *exit_code;
  MPI_Init(&argc, &argv);
  int exit_code = 1;
  {
    const Ranks ranks(MPI_COMM_WORLD);
    const Screen screen(ranks.first());
    exit_code = run(options, ranks);
    MPI_Bcast(&exit_code, 1, MPI_INT, 0, MPI_COMM_WORLD);
  }
  MPI_Finalize();
  return exit_code;
}
