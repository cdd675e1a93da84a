#pragma once
// Measures for `tandem bench client` the time that a client's own code takes.

#include <cstdint>
#include <string>

#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// Processor time of the calling thread.
[[nodiscard]] std::int64_t thread_cpu_ns();

struct ClientCostSetup {
  sessions::SessionChoice choice;
  std::uint64_t seed = 1;
  std::uint64_t frames = 300;  ///< measured, after the first 60
};

/// Milliseconds. They count the calling thread's own time on a core, so that other programs on the machine
/// matter little; but waiting is part of `beside`.
struct Cost {
  double p50 = 0, p99 = 0, p999 = 0;
};

struct ClientCostRow {
  std::string scene, predictor, codec;
  std::uint32_t bodies = 0;
  std::uint64_t frames = 0;
  double corrected_per_frame = 0;  ///< bodies
  Cost engine = {};                ///< a step of the full simulation, one thread
  /// The work of a client in a frame without sampling: taking messages, the predicted step, decoding,
  /// applying, checking the hash, acknowledging.
  Cost frame = {};
  Cost predicted = {};      ///< the predicted step's part of it
  Cost sampled_frame = {};  ///< like `frame`, for a client that also prepares what is sampled
  Cost sample = {};         ///< positions, velocities, alive and types of all bodies, at 144 Hz
  Cost beside = {};         ///< the same by the wall clock, in a thread of its own while another one applies
};

/// One server and two clients with lead 1 over a network in memory, in simulated time. Errors: what the scene
/// or the host refuse; kTimeout when the clients never play.
[[nodiscard]] Result<ClientCostRow> measure_client_cost(const scenes::Scene& scene,
                                                        const ClientCostSetup& setup);

}  // namespace tandem::lab
