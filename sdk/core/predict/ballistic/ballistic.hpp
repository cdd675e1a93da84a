#pragma once

#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// The predictor `ballistic`: gravity, damping and the learned acceleration c. Bodies do not interact.
/// O(capacity) per step, no scratch memory.
class Ballistic final : public Predictor {
 public:
  void step(const State& from, State& to, const StepInput& input) override;
  void step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return false; }
};

}  // namespace tandem
