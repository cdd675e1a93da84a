#include "tests/fault/world/faults/engine_faults.hpp"

#include <algorithm>

#include "tests/fault/world/settings.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::world {

bool of_an_engine(FaultKind kind) {
  return kind == FaultKind::kEngineDies || kind == FaultKind::kEngineStops;
}

void add_engine_faults(std::uint64_t seed, const PlanWishes& wishes, Plan& plan) {
  const auto wished = [&](FaultKind kind) {
    return std::ranges::find(wishes.kinds, kind) != wishes.kinds.end();
  };
  const auto lost = [](const Fault& fault) { return fault.kind == FaultKind::kLostForGood; };
  if (!has_engine_process(seed) || std::ranges::any_of(plan, lost)) return;
  Dice dice(seed * 0x9E3779B97F4A7C15ULL + 7);
  for (std::uint64_t i = 1 + dice.below(4); i > 0; --i) {
    Fault fault;
    fault.kind = dice.chance(0.5) ? FaultKind::kEngineDies : FaultKind::kEngineStops;
    fault.at_ms = wishes.from_ms + static_cast<std::int64_t>(dice.below(static_cast<std::uint64_t>(
                                       std::max<std::int64_t>(1, wishes.until_ms - wishes.from_ms))));
    fault.whom = dice.chance(0.6) ? 0 : static_cast<std::uint32_t>(dice.below(1000));
    const double length = dice.uniform(0, 1);
    fault.for_ms =
        fault.kind == FaultKind::kEngineStops ? static_cast<std::int64_t>(20 + 3500 * length * length) : 0;
    if (wished(fault.kind)) plan.push_back(fault);
  }
  std::ranges::stable_sort(plan, {}, &Fault::at_ms);
  for (std::uint32_t i = 0; i < plan.size(); ++i) plan[i].id = i;
}

}  // namespace tandem::world
