#pragma once

#include <memory>
#include <string>

#include "services/engine/common/world.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Makes the particle simulation of `world`, at frame 0, on `threads` threads (1: none of its own; at most
/// 64). Errors: kInvalidArgument, naming the value that is out of range.
[[nodiscard]] Result<std::unique_ptr<Simulation>> make_particles(const World& world, std::uint32_t threads);

}  // namespace tandem::engine
