#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "services/engines/common/world.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// The instructions of the inner loops. All give the same bits.
enum class Instructions : std::uint8_t { kBest, kScalar, kAvx2, kAvx512 };

/// Makes the particle simulation of `world`, at frame 0, on `threads` threads (1: none of its own; at most
/// 64). Where the processor lacks `instructions`, others are used. Errors: kInvalidArgument, naming the value
/// that is out of range.
[[nodiscard]] Result<std::unique_ptr<Simulation>> make_particles(
    const EngineWorld& world, std::uint32_t threads, Instructions instructions = Instructions::kBest);

}  // namespace tandem::engine
