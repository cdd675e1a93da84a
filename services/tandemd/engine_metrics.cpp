#include "services/tandemd/engine_metrics.hpp"

namespace tandem::daemon {

void describe(metrics::Page& page, const EngineNow& engine) {
  page.gauge("tandem_engine_info", "The engine in another process, as label", 1, {{"engine", engine.name}});
  page.state(
      "tandem_engine_state",
      "1 for the state of the engine in another process: another one is awaited, it serves, it is slower "
      "than half of its limit, or it is stopped by a signal",
      {"awaited", "serves", "slow", "stopped"}, static_cast<std::size_t>(engine.state));
  page.count("tandem_engine_restarts_total", "Engines that came after the first one",
             static_cast<double>(engine.restarts));
  page.durations("tandem_engine_round_trip_seconds",
                 "Time from the question for a step to the answer of the engine", engine.round_trip);
  page.durations("tandem_engine_step_seconds", "Time of its step, if the engine says it", engine.step_took);
}

void EngineWatch::begin(const engine::door::Door& door) {
  if (began_) ++counted_.restarts;
  began_ = true;
  door_ = &door;
  counted_.name = door.hello().name;
}

void EngineWatch::lost() { door_ = nullptr; }

void EngineWatch::count_step() {
  if (door_ == nullptr) return;
  const engine::door::Figures step = door_->figures();
  counted_.round_trip.add(step.trip_ns);
  if (step.step_ns != 0) counted_.step_took.add(step.step_ns);
}

EngineNow EngineWatch::now() const {
  EngineNow now = counted_;
  if (door_ == nullptr) return now;
  const engine::door::Figures step = door_->figures();
  now.state = step.stopped ? EngineNow::State::kStopped
              : step.slow  ? EngineNow::State::kSlow
                           : EngineNow::State::kServes;
  return now;
}

}  // namespace tandem::daemon
