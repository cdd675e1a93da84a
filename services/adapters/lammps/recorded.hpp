// SPDX-License-Identifier: MIT
#pragma once
// Which of a script's commands a world needs again after its atoms came from a restart file.

#include <string>
#include <vector>

#include "services/adapters/lammps/facts.hpp"

namespace tandem_lammps {

/// The commands in force, in their order. What a later command undoes or replaces is forgotten, so that a
/// loop of a script makes no list without end. Pure.
class Recorded {
 public:
  void add(const Words& words);
  void clear() { lines_.clear(); }
  [[nodiscard]] const std::vector<Words>& lines() const { return lines_; }

  /// Such a command comes before the restart file is read; the others come after it.
  [[nodiscard]] static bool comes_before_atoms(const Words& words);
  /// A style of forces that comes with the restart file, with coefficients that no command gave but a data
  /// file.
  [[nodiscard]] bool comes_with_atoms(const Words& words) const;
  /// A variable that `next` moves.
  [[nodiscard]] static bool is_loop(const Words& words);

 private:
  template <class Test>
  void forget(const Test& test);
  void forget_of(const char* command, const std::string& id);

  std::vector<Words> lines_ = {};
};

/// A line that LAMMPS splits into these words.
[[nodiscard]] std::string joined(const Words& words);

}  // namespace tandem_lammps
