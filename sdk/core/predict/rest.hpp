#pragma once
// Bodies at rest: the one rule that all predicted steps share. idl/PROTOCOL.md, "Predicted step".

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/drive.hpp"

namespace tandem {

/// Whether a body with this c stays at rest under the drive: c holds it up on every axis.
[[nodiscard]] inline bool holds_still(const Vec3i& c, const Drive& drive) {
  return c[0] == -drive.gravity[0] && c[1] == -drive.gravity[1] && c[2] == -drive.gravity[2];
}

/// Before a step: writes to `to` who of `from` is still at rest; they may be the same object. True if anybody
/// is. Next to nothing where nobody was.
bool keep_at_rest(const State& from, State& to, const Drive& drive);

}  // namespace tandem
