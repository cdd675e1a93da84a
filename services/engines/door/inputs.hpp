#pragma once
// What an engine takes of its users' inputs. Pure.

#include "services/engines/door/wire.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine::door {

/// Judges an input by what the engine said in HELLO; the reason of a refusal is for its sender.
[[nodiscard]] Classification classify(const Hello& hello, const Input& input);

}  // namespace tandem::engine::door
