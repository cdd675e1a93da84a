#pragma once

namespace tandem::lab {

/// The text of pile.lammps, which the build puts in.
extern const char* const kPileScript;

}  // namespace tandem::lab
