#pragma once
// Measures for `bench_lab memory` the bytes that a server and a client hold while a session runs.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "services/host/host.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::lab {

/// Heap bytes with the allocator's overhead.
struct MemoryUse {
  std::int64_t engine_bytes = 0;  ///< the full simulation
  std::int64_t server_bytes = 0;  ///< the host without engine and transport
  std::int64_t client_bytes = 0;  ///< a playing client that samples every frame, without its transport
};

/// A simulation and how a host would publish it.
struct HostedSimulation {
  std::unique_ptr<engine::Simulation> simulation;
  host::HostConfig config;
};

/// Runs one server and one client over a network in memory for `frames` frames, then destroys one after the
/// other and measures how much of the heap each returns; memory of the transport is not counted. Errors: what
/// `make` or the host refuse; kTimeout when the client never plays.
[[nodiscard]] Result<MemoryUse> measure_memory(const std::function<Result<HostedSimulation>()>& make,
                                               std::uint64_t frames);

}  // namespace tandem::lab
