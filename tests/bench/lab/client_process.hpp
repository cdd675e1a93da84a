#pragma once
// Measures for `bench_lab client` the whole cost of a client that is a separate process.

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

struct ClientProcessSetup {
  std::string tandem, tandemd;  ///< paths of the programs
  std::string scene;
  sessions::SessionChoice choice;
  std::uint64_t seed = 1;
  std::uint32_t domain = 0;
  unsigned runs = 5;
  double settle_s = 5;  ///< from the client's start to the first reading; joining is over by then
  double seconds = 20;  ///< from the first to the second reading
  const std::atomic<bool>* stop = nullptr;  ///< ends a run early; must outlive the measurement
};

/// Medians over the runs. If not stated otherwise, milliseconds of processor time per frame, for all threads
/// together.
struct ClientProcessRow {
  double frames_per_s = 0;
  double cpu_ms = 0, cpu_ms_least = 0, cpu_ms_most = 0;
  std::map<std::string, double> by_thread;  ///< threads with the same name are added up
  /// The client's own stopwatches: receive, predict, decode, hash, acknowledge, and dds: all the rest.
  std::map<std::string, double> by_kind;
  std::optional<double> syscalls;  ///< per frame; empty if the kernel does not show them
  double wakeups_per_s = 0;        ///< of all threads
  double idle_wakeups_per_s = 0;   ///< the same while the server is suspended
  double resident_mb = 0;          ///< 2^20 bytes
};

/// Runs `tandemd` and `tandem join` over DDS on loopback. The client is a participant with lead 1; the
/// scene's scripted users send inputs. The result is the difference of two readings, and so excludes start
/// and joining. Then suspends the server and counts again. Errors: kIo.
[[nodiscard]] Result<ClientProcessRow> measure_client_process(const ClientProcessSetup& setup);

/// Median of the full simulation's step over the same stretch of the scene, on one thread. Errors: what the
/// scene refuses; kIo when stopped.
[[nodiscard]] Result<double> measure_engine_step(const scenes::Scene& scene, const ClientProcessSetup& setup);

}  // namespace tandem::lab
