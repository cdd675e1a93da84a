#pragma once
// The predicted simulation: the cheap deterministic step that the server and every client run.

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/drive.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// A predicted step, all in integers. One object per timeline: it may keep scratch memory between calls.
class Predictor {
 public:
  virtual ~Predictor() = default;
  /// The tier whose steps these are: `field` in a world of one sub-step is `contact`.
  [[nodiscard]] virtual std::string_view name() const = 0;

  /// Writes into `to` the state that follows `from`. Both have the same capacity; they may be the same
  /// object. Allocates nothing. Dead slots stay all zero.
  virtual void step(const State& from, State& to, const StepInput& input) = 0;

  /// The same for the listed slots only; other slots of `to` keep what they hold. Called only where
  /// `interacts()` is false, after a delta touched a few bodies of an earlier frame.
  virtual void step_slots(const State& from, State& to, const StepInput& input,
                          std::span<const Slot> slots) = 0;

  /// True where a body's next state depends on other bodies, so that a late correction re-simulates all of
  /// them.
  [[nodiscard]] virtual bool interacts() const = 0;
};

}  // namespace tandem
