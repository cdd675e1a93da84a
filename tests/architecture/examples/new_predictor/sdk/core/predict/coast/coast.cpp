#include "sdk/core/predict/coast/coast.hpp"

#include <algorithm>

namespace tandem {
namespace {

// v += g;  clamp v to +-2^28;  p += (v + 32) >> 6;  clamp p to +-2^30
void step_slot(const State& from, State& to, const StepInput& input, Slot s) {
  to.alive()[s] = from.alive()[s];
  to.reuse()[s] = from.reuse()[s];
  to.type()[s] = from.type()[s];
  to.rest()[s] = from.rest()[s];
  const bool moves = from.alive()[s] != 0 && from.rest()[s] == 0;
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    const std::int32_t fallen =
        std::clamp(from.v(i)[s] + input.drive.gravity[i], -kVelocityLimit, kVelocityLimit);
    const std::int32_t v = moves ? fallen : from.v(i)[s];
    const std::int32_t moved = std::clamp(from.p(i)[s] + ((v + 32) >> 6), -kPositionLimit, kPositionLimit);
    to.p(i)[s] = moves ? moved : from.p(i)[s];
    to.v(i)[s] = v;
    to.c(i)[s] = from.c(i)[s];
  }
}

}  // namespace

void Coast::step(const State& from, State& to, const StepInput& input) {
  for (Slot s = 0; s < from.capacity(); ++s) step_slot(from, to, input, s);
  step_groups(from, to);
}

void Coast::step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) {
  for (const Slot s : slots) step_slot(from, to, input, s);
  step_groups(from, to, slots);
}

}  // namespace tandem
