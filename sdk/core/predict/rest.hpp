#pragma once
// The rule for bodies at rest, which all predicted steps share. idl/PROTOCOL.md, "Predicted step".

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/drive.hpp"

namespace tandem {

/// True if a body with this c stays at rest under the drive: c holds it up on every axis.
[[nodiscard]] inline bool holds_still(const Vec3i& c, const Drive& drive) {
  return c[0] == -drive.gravity[0] && c[1] == -drive.gravity[1] && c[2] == -drive.gravity[2];
}

/// Call before a step: writes to `to` which bodies of `from` are still at rest. `from` and `to` may be the
/// same. Returns true if there are any. It costs almost nothing if none was at rest.
bool keep_at_rest(const State& from, State& to, const Drive& drive);
/// Does the same for `count` slots from `first` on. Returns how many bodies are still at rest.
std::uint32_t keep_at_rest(const State& from, State& to, const Drive& drive, Slot first, std::uint32_t count);
/// True if every body of these slots is at rest.
[[nodiscard]] bool all_at_rest(const State& state, Slot first, std::uint32_t count);

}  // namespace tandem
