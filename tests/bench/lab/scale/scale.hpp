#pragma once
// The measurement of `bench_lab scale`: the stages of a frame by number of bodies, threads, predictor and
// state.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// What the bodies do while they are measured.
enum class Motion : std::uint8_t {
  kMoving,   ///< the scene's scripted users act, from its start on
  kSettled,  ///< nobody acts, after the warm-up
  kStirred,  ///< nobody acts during the warm-up, then the scripted users
};

struct ScaleSetup {
  sessions::SessionChoice choice;  ///< bodies, predictor, codec, threads of the streams
  std::uint32_t threads = 1;       ///< of the engine
  bool pipeline = false;           ///< host::HostConfig::pipeline, and steps on a thread of their own
  Motion motion = Motion::kMoving;
  /// Steps of the engine before the session begins; a settled row begins when (nearly) all bodies stand
  /// still, after so many steps at the latest.
  std::uint64_t warm_up = 60;
  std::uint64_t frames = 120;  ///< measured; the client must apply as many
  std::uint64_t seed = 1;
  std::uint32_t domain = 0;
  double patience_s = 300;  ///< for all frames
  const std::atomic<bool>* stop = nullptr;
};

/// Milliseconds of wall clock.
struct StageTime {
  double p50 = 0, p99 = 0;
};

struct ScaleRow {
  StageTime step, quantise, predict, encode, apply, publish, frame;
  StageTime client_decode, client_apply, client_predict;
  std::uint64_t warm_up = 0;  ///< steps of the engine before the session began
  double standing = 0;        ///< share of the bodies that stood still then
  double mbit_per_s = 0;      ///< payload at the nominal rate; 2^20 bits to the Mbit
  double frames_per_s = 0;
  double corrected_per_frame = 0;             ///< bodies
  std::optional<double> colliding_per_frame;  ///< bodies; empty: a step was always under way
  double engine_bytes = 0, server_bytes = 0;  ///< heap a body: the simulation; the host without it
  double client_bytes = 0;                    ///< heap a body of the client's process
};

/// Plays the frames. Errors: what scene, plan and host refuse; kTransport; kIo (the client failed), kTimeout.
[[nodiscard]] Result<ScaleRow> measure_scale(const scenes::Scene& scene, const ScaleSetup& setup);

/// The client's half, in a process of its own: joins `session`, applies `frames` frames and prints one JSON
/// object. Returns an exit code.
int play_scale(const std::string& session, std::uint32_t domain, std::uint64_t frames);

}  // namespace tandem::lab
