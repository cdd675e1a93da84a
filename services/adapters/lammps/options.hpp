// SPDX-License-Identifier: MIT
#pragma once
// The command line of tandem-lammps.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tandem_lammps {

struct LammpsOptions {
  std::string script;
  std::string socket;                   // empty: TANDEM_DOOR
  std::int64_t every = 0;               // steps a frame; 0: chosen
  double rate_hz = 0;                   // frames a second; 0: chosen
  std::uint32_t capacity = 0;           // 0: chosen
  double radius = 0;                    // of atoms that have none; 0: chosen
  std::optional<double> gravity, push;  // the largest ones that users may send; nothing: chosen
  double threshold = 0;                 // 0: the server chooses
  std::string session;                  // empty: the server chooses
  bool endless = false;
  std::vector<std::string> for_lammps;  // -var NAME VALUE and what stands behind --
};

/// Reads the command line. An exit code instead: 0 after --help and the like, 2 for a wrong line, which it
/// prints if `prints`.
std::optional<int> parse(int argc, const char* const* argv, bool prints, LammpsOptions& options);

}  // namespace tandem_lammps
