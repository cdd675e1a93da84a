#pragma once
// What would be drawn without corrections.

#include <cstdint>
#include <memory>

#include "sdk/core/timeline/timeline.hpp"

namespace tandem::client {

/// How far the bodies of an uncorrected state are from where they are agreed to be.
struct Drift {
  Frame frames = 0;           ///< since the last correction
  std::uint32_t bodies = 0;   ///< alive in both states
  double mean = 0, most = 0;  ///< distances, lattice units; 0 without bodies
};

/// A copy of the agreed state that is only predicted from then on, with the scheduled inputs, but without any
/// delta: nobody spawns, and parameters stay as they were. Touches nothing of the timeline. A step of all
/// bodies a frame. Not thread-safe.
class Uncorrected {
 public:
  /// From the agreed state of `timeline`, which holds one, of a stream with `layout`.
  Uncorrected(const Layout& layout, const ClientTimeline& timeline);

  /// After each ClientTimeline::apply() of that timeline.
  void on_applied(const ClientTimeline& timeline);

  /// At the frame that was applied last.
  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const Drift& drift() const { return drift_; }

 private:
  void measure(const State& agreed);

  std::unique_ptr<Predictor> predictor_;
  State state_;
  StepParameters parameters_;
  Drift drift_;
};

}  // namespace tandem::client
