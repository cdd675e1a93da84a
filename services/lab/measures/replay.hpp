#pragma once
// Runs a simulation with its scripted inputs frame by frame, to drive streams where there are no clients.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/clock.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::lab {

/// Acts in the step that produces `frame`.
struct TimedInput {
  Frame frame = 0;
  engine::Input input;
};

/// Steps `simulation`, which must outlive this object and was not stepped yet. Not thread-safe.
class Replay {
 public:
  /// `script` ascends by frame. Errors: kInvalidArgument when gravity or damping do not fit the lattice.
  static Result<Replay> create(engine::Simulation& simulation, std::vector<TimedInput> script,
                               const host::Lattice& lattice);

  /// Produces the next frame. Errors: kInvalidArgument for a scripted input that the simulation refuses.
  Result<void> next();

  [[nodiscard]] Frame frame() const { return frame_; }
  /// Inputs that change the predicted step and act in the step that produced frame().
  [[nodiscard]] std::span<const ScheduledDrive> scheduled() const { return scheduled_; }
  /// The drive in force before the first step.
  [[nodiscard]] const Drive& start_drive() const { return start_drive_; }
  [[nodiscard]] const engine::Simulation& simulation() const { return *simulation_; }
  /// Duration of the engine's step in the last next().
  [[nodiscard]] std::int64_t step_ns() const { return step_ns_; }

 private:
  Replay(engine::Simulation& simulation, std::vector<TimedInput> script, const host::Lattice& lattice,
         const Drive& start_drive);
  Result<void> take(const engine::Input& input);
  void schedule(const Drive& drive);
  /// A recorded trajectory changes its gravity without an input.
  Result<void> follow_gravity();

  engine::Simulation* simulation_;
  std::vector<TimedInput> script_;
  host::Lattice lattice_;
  Drive start_drive_, drive_;
  std::vector<ScheduledDrive> scheduled_;
  std::size_t next_input_ = 0;
  std::uint64_t input_number_ = 0;
  Frame frame_ = 0;
  std::int64_t step_ns_ = 0;
};

using transport::steady_ns;

}  // namespace tandem::lab
