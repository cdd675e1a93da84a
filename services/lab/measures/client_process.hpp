#pragma once
// What `tandem bench client` measures: the whole cost of a client, as a separate process.

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "services/scenes/scene.hpp"
#include "services/sessions/session_plan.hpp"
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
  double seconds = 20;  ///< from there to the second reading
  const std::atomic<bool>* stop = nullptr;  ///< ends a run early; must outlive the measurement
};

/// Medians over the runs. Milliseconds of processor time a frame, of all threads together, unless said
/// otherwise.
struct ClientProcessRow {
  double frames_per_s = 0;
  double cpu_ms = 0, cpu_ms_least = 0, cpu_ms_most = 0;
  std::map<std::string, double> by_thread;  ///< threads of one name together
  /// The client's own stopwatches: receive, predict, decode, hash, acknowledge, and dds: all the rest.
  std::map<std::string, double> by_kind;
  std::optional<double> syscalls;  ///< a frame; nothing where the kernel does not tell
  double wakeups_per_s = 0;        ///< of all threads
  double idle_wakeups_per_s = 0;   ///< the same while the server is suspended
  double resident_mb = 0;          ///< 2^20 bytes
};

/// Runs `tandemd` and `tandem join` over loopback, DDS included: as a participant with lead 1, the scripted
/// users of the scene giving input. What is counted is the difference of two readings, so that nothing of
/// start and joining is in it. Then suspends the server and counts again. Errors: kIo.
[[nodiscard]] Result<ClientProcessRow> measure_client_process(const ClientProcessSetup& setup);

/// Median of the full simulation's step over the same stretch of the scene, on one thread. Errors: what the
/// scene refuses; kIo when stopped.
[[nodiscard]] Result<double> measure_engine_step(const scenes::Scene& scene, const ClientProcessSetup& setup);

}  // namespace tandem::lab
