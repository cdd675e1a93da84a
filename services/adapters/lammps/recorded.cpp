// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/recorded.hpp"

#include <algorithm>

namespace tandem_lammps {
namespace {

const Words kBeforeAtoms{"atom_modify", "box",        "molecule", "newton",
                         "package",     "processors", "python",   "suffix"};
const Words kAfterAtoms{"balance",
                        "comm_modify",
                        "comm_style",
                        "compute",
                        "compute_modify",
                        "dielectric",
                        "dump",
                        "dump_modify",
                        "fix",
                        "fix_modify",
                        "group",
                        "lattice",
                        "mass",
                        "min_modify",
                        "min_style",
                        "neigh_modify",
                        "neighbor",
                        "region",
                        "restart",
                        "run_style",
                        "special_bonds",
                        "thermo",
                        "thermo_modify",
                        "thermo_style",
                        "timer",
                        "timestep",
                        "variable",
                        "kspace_style",
                        "kspace_modify",
                        "pair_style",
                        "pair_coeff",
                        "pair_modify",
                        "bond_style",
                        "bond_coeff",
                        "angle_style",
                        "angle_coeff",
                        "dihedral_style",
                        "dihedral_coeff",
                        "improper_style",
                        "improper_coeff",
                        "kim"};
// Of these the last one counts alone.
const Words kOneOfAKind{"dielectric", "kspace_style", "min_style",    "neighbor", "restart",
                        "run_style",  "thermo",       "thermo_style", "timestep"};
// They have an ID, which is their second word.
const Words kWithId{"compute", "dump", "fix", "region", "variable"};

/// "pair" of "pair_style"; empty if it is no style of forces.
std::string force_of(const std::string& command) {
  for (const char* const force : {"pair", "bond", "angle", "dihedral", "improper"})
    if (command == std::string(force) + "_style") return force;
  return {};
}

}  // namespace

template <class Test>
void Recorded::forget(const Test& test) {
  lines_.erase(std::remove_if(lines_.begin(), lines_.end(), test), lines_.end());
}

void Recorded::forget_of(const char* command, const std::string& id) {
  const std::string modify = std::string(command) + "_modify";
  forget([&](const Words& line) {
    return (line[0] == command || line[0] == modify) && line.size() > 1 && line[1] == id;
  });
}

void Recorded::add(const Words& words) {
  if (words.empty()) return;
  const std::string& name = words[0];
  if (name == "clear") return clear();
  if (words.size() > 1)
    for (const char* const command : {"fix", "compute", "dump"})
      if (name == std::string("un") + command) return forget_of(command, words[1]);
  if (words.size() == 3 && words[2] == "delete" && (name == "variable" || name == "region"))
    return forget_of(name.c_str(), words[1]);
  if (!comes_before_atoms(words) && !holds(kAfterAtoms, name)) return;
  // Members of other groups are in the restart file.
  if (name == "group" && !(words.size() > 2 && words[2] == "dynamic")) return;
  if (holds(kOneOfAKind, name)) forget([&](const Words& line) { return line[0] == name; });
  if (name == "thermo_style") forget([](const Words& line) { return line[0] == "thermo_modify"; });
  if (const std::string force = force_of(name); !force.empty() && words.size() > 1) {
    // Another style knows nothing of the last one's coefficients.
    const auto last =
        std::find_if(lines_.begin(), lines_.end(), [&](const Words& line) { return line[0] == name; });
    const bool other = last == lines_.end() || (*last).size() < 2 || (*last)[1] != words[1];
    if (other || words[1].starts_with("hybrid"))
      forget([&](const Words& line) { return line[0].starts_with(force + "_"); });
  }
  // The first one stays, for the order of fixes is that of their IDs; of those that replaced it, the last
  // one.
  if (holds(kWithId, name) && words.size() > 1) {
    const auto same = [&](const Words& line) {
      return line[0] == name && line.size() > 1 && line[1] == words[1];
    };
    const auto last = std::find_if(lines_.rbegin(), lines_.rend(), same);
    if (last != lines_.rend() && (*last == words || is_loop(words))) return;
    const auto first = std::find_if(lines_.begin(), lines_.end(), same);
    if (first != lines_.end()) lines_.erase(std::remove_if(first + 1, lines_.end(), same), lines_.end());
  } else if (name == "lattice") {  // it is the unit of the regions behind it
    const auto last =
        std::find_if(lines_.rbegin(), lines_.rend(), [](const Words& line) { return line[0] == "lattice"; });
    if (last != lines_.rend() && *last == words) return;
  } else {
    forget([&](const Words& line) { return line == words; });
  }
  lines_.push_back(words);
}

bool Recorded::comes_before_atoms(const Words& words) {
  if (words.size() > 1 && words[0] == "kim") return words[1] == "init";
  return !words.empty() && holds(kBeforeAtoms, words[0]);
}

bool Recorded::comes_with_atoms(const Words& words) const {
  const std::string force = words.size() < 2 ? "" : force_of(words[0]);
  if (force == "pair")
    return std::none_of(lines_.begin(), lines_.end(),
                        [](const Words& line) { return line[0] == "pair_coeff"; });
  return !force.empty() && !words[1].starts_with("hybrid") && words[1] != "table";
}

bool Recorded::is_loop(const Words& words) {
  static const Words kStyles{"atomfile", "file", "index", "loop"};
  return words.size() > 2 && words[0] == "variable" && holds(kStyles, words[2]);
}

std::string joined(const Words& words) {
  std::string line;
  for (const std::string& word : words) {
    const bool plain = !word.empty() && word.find_first_of(" \t\"'#&$\n") == std::string::npos;
    const bool has_double = word.find('"') != std::string::npos,
               has_single = word.find('\'') != std::string::npos;
    const char* const mark = plain                                                 ? ""
                             : !has_double && word.find('\n') == std::string::npos ? "\""
                             : has_single || !has_double                           ? "\"\"\""
                                                                                   : "'";
    line += (line.empty() ? "" : " ") + (mark + word) + mark;
  }
  return line;
}

}  // namespace tandem_lammps
