#pragma once

#include <vector>

#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// The predictor `ballistic`: gravity, damping and the learned acceleration c. Bodies do not interact.
/// O(capacity) per step.
class Ballistic final : public Predictor {
 public:
  void step(const State& from, State& to, const StepInput& input) override;
  /// Leaves out each block at rest, and steps the others side by side.
  void step_blocks(const State& from, State& to, const StepInput& input, const StepLedgers& ledgers) override;
  void step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return false; }

 private:
  std::vector<std::uint32_t> moving_;  // blocks of the current step
};

}  // namespace tandem
