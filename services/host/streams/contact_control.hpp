#pragma once
// Learns at run time what a predictor of hard contacts needs: radii, friction, and how round edges are. The
// choice travels in the deltas.

#include <cstdint>
#include <span>

#include "sdk/core/layout/parameters.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem::host {

/// Sets the parameters of the first frame, for a predictor of hard contacts. `shapes`: it reads the bodies'
/// shapes and spins.
void set_first_contacts(StreamParameters& parameters, bool shapes = false);

/// Observes every frame and decides after every fifteenth. Deterministic; reads no clock. Not thread-safe.
///
/// If bodies have to be corrected in the direction in which contacts pushed them, the pushes were too weak:
/// radii become longer. If they have to be corrected in that of friction, friction becomes stronger. If they
/// have to be corrected in the direction in which edges of boxes pushed them, edges become less round.
class ContactControl {
 public:
  /// `parameters`: those in force at the start. `shapes`: the predictor reads the bodies' shapes and spins.
  /// Then sizes are about right from the start and change slowly, and friction by many corrections only.
  ContactControl(std::uint32_t bodies, const StreamParameters& parameters, bool shapes = false);

  /// Takes a frame before its corrections, and the pushes of the step that predicted it.
  void observe(const State& predicted, const State& target, std::int32_t threshold,
               std::span<const Push> pushes);
  /// Call after each frame. Returns true if it changed a parameter.
  bool after_frame(StreamParameters& parameters);

 private:
  struct Mean {
    double sum = 0, count = 0;
    void add(double cosine) { sum += cosine, count += 1; }
    [[nodiscard]] double value() const { return count > 0 ? sum / count : 0; }
  };

  // How fast one of the radii changes.
  struct Pace {
    double last = 0, speed = 1;
    double step(double off);
    /// For sizes of shapes, which are nearly right: half as fast after each step that went too far.
    double careful_step(double off);
  };

  bool shapes_;
  double enough_;  // number of corrections that a decision needs
  double radius_, wall_, friction_, rounding_;
  std::uint32_t frames_ = 0;
  Pace radius_pace_, wall_pace_;
  Mean radius_seen_, wall_seen_, friction_seen_, edges_seen_;
};

}  // namespace tandem::host
