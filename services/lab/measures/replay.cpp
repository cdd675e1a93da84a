#include "services/lab/measures/replay.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>

namespace tandem::lab {

Replay::Replay(engine::Simulation& simulation, std::vector<TimedInput> script, const host::Lattice& lattice,
               const Drive& start_drive)
    : simulation_(&simulation),
      script_(std::move(script)),
      lattice_(lattice),
      start_drive_(start_drive),
      drive_(start_drive) {}

Result<Replay> Replay::create(engine::Simulation& simulation, std::vector<TimedInput> script,
                              const host::Lattice& lattice) {
  return host::to_drive(lattice, simulation.gravity(), simulation.damping_per_s())
      .map([&](const Drive& drive) { return Replay(simulation, std::move(script), lattice, drive); });
}

Result<void> Replay::take(const engine::Input& input) {
  const engine::Classification found = simulation_->classify(input);
  if (found.effect == engine::Classification::Effect::kRefused) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("the scripted input of frame {} is refused: {}", frame_, found.reason));
  }
  if (found.effect == engine::Classification::Effect::kScheduled) {
    const auto drive = host::to_drive(lattice_, found.gravity, found.damping_per_s);
    if (!drive) return tl::unexpected(drive.error());
    schedule(*drive);
  }
  simulation_->apply(input);
  return {};
}

void Replay::schedule(const Drive& drive) {
  drive_ = drive;
  scheduled_.push_back({++input_number_, frame_, drive});
}

Result<void> Replay::follow_gravity() {
  if (!scheduled_.empty()) return {};
  return host::to_drive(lattice_, simulation_->gravity(), simulation_->damping_per_s())
      .map([&](const Drive& now) {
        if (now != drive_) schedule(now);
      });
}

Result<void> Replay::next() {
  ++frame_;
  scheduled_.clear();
  for (; next_input_ < script_.size() && script_[next_input_].frame <= frame_; ++next_input_) {
    if (auto taken = take(script_[next_input_].input); !taken) return taken;
  }
  if (auto followed = follow_gravity(); !followed) return followed;
  const std::int64_t before = steady_ns();
  simulation_->step();
  step_ns_ = steady_ns() - before;
  return {};
}

}  // namespace tandem::lab
