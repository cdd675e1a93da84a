#pragma once

#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// Gravity alone: no damping, nothing is learned.
class Coast final : public Predictor {
 public:
  void step(const State& from, State& to, const StepInput& input) override;
  void step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return false; }
};

}  // namespace tandem
