#pragma once
// The whole of Tandem in one process: the real code of each program on a simulated network, disk and clock.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "tests/fault/world/faults/chaos.hpp"
#include "tests/fault/world/stage.hpp"

namespace tandem::world {

struct Counts {
  std::uint64_t frames = 0, acts = 0, epochs = 0, turns = 0;
  transport::simulated::NetworkCounts network;
};

struct Outcome {
  std::optional<Finding> finding;
  std::uint64_t digest = 0;
  Counts counts;
  Journal journal;
};

struct RunOptions {
  std::uint64_t seed = 1;
  double seconds = 60;
  std::string record;  ///< a file to write the world to; empty: none
};

[[nodiscard]] Plan plan_of(const RunOptions& options, const std::vector<FaultKind>& kinds);

/// Lets a world live, up to the first rule that is broken.
[[nodiscard]] Outcome run_world(const RunOptions& options, const Plan& plan);
/// The time of the world that lives.
[[nodiscard]] std::int64_t living_ns();

}  // namespace tandem::world
