#pragma once

namespace tandem::lab {

/// The text of pile.lammps, which the build puts in.
[[nodiscard]] const char* pile_script();

}  // namespace tandem::lab
