// SPDX-License-Identifier: MIT
#pragma once
// What LAMMPS prints.

namespace tandem_lammps {

/// Between making and destroying one, standard output of the first rank loses the lines that LAMMPS prints
/// for every piece of a run: the head and the rows of its table. All else passes, errors to the last line.
class Screen {
 public:
  explicit Screen(bool first);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

 private:
  bool on_ = false;
};

}  // namespace tandem_lammps
