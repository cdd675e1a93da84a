#pragma once
// The bodies as they would be drawn without corrections.

#include <cstdint>
#include <memory>

#include "sdk/core/timeline/timeline.hpp"

namespace tandem::client {

/// The distance of the bodies of an uncorrected state from their agreed places.
struct Drift {
  Frame frames = 0;           ///< since the last correction
  std::uint32_t bodies = 0;   ///< alive in both states
  double mean = 0, most = 0;  ///< distances, lattice units; 0 without bodies
};

/// A copy of the agreed state that is only predicted from then on. It takes scheduled inputs but no deltas:
/// no body spawns, and parameters stay as they were. It changes nothing in the timeline. It costs one step of
/// all bodies per frame. Not thread-safe.
class Uncorrected {
 public:
  /// Starts from the agreed state of `timeline`, which holds one, of a stream with `layout`.
  Uncorrected(const Layout& layout, const ClientTimeline& timeline);

  /// Call after each ClientTimeline::apply() of that timeline.
  void on_applied(const ClientTimeline& timeline);

  /// The uncorrected state at the frame that was applied last.
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
