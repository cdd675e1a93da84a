#pragma once
// Chooses a session's lattice and converts scene units to lattice units, once for each value.

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/predict/drive.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// The integer lattice of a session, seen from the scene's units.
struct Lattice {
  double unit = 0;   ///< scene units per lattice unit
  double dt_s = 0;   ///< seconds per frame
  int halvings = 0;  ///< s: unit = smallest permitted threshold / 2^s
  /// Lattice units per scene unit.
  [[nodiscard]] double position_scale() const { return 1.0 / unit; }
  /// 1/64 lattice unit per frame, per scene unit per second.
  [[nodiscard]] double velocity_scale() const { return 64.0 * dt_s / unit; }
  bool operator==(const Lattice&) const = default;
};

inline constexpr int kMaxHalvings = 12;    ///< a finer lattice gains nothing
inline constexpr int kFewestHalvings = 8;  ///< a coarser lattice would show in the error

/// Chooses the unit: smallest permitted threshold / 2^s, with the maximum s, up to 12, that leaves a factor
/// of four to the bounds. `extent` is the maximum |coordinate| inside the world's bounds. All values are in
/// scene units. Errors: kInvalidArgument for values that are not finite and positive, or if s would be below
/// 8.
[[nodiscard]] Result<Lattice> choose_lattice(double smallest_threshold, double extent, double dt_s);

/// Converts threshold and quantisation ranges (scene units; per second for velocity) to integers. A range of
/// 0 means untrained and stands for eight thresholds (per frame for velocity). Steps are rounded up so that
/// 127 of them cover the range. Errors: kInvalidArgument for values that are negative, not finite or finer
/// than the lattice.
[[nodiscard]] Result<CodecParameters> codec_parameters(const Lattice& lattice, double threshold,
                                                       double position_range, double velocity_range);

/// Sets the steps of turns. `turn_range` (rad) and `spin_range` (rad/s) are ranges as in codec_parameters().
/// A range of 0 stands for turns that move the surface of a body of `radius` (scene units) by eight
/// thresholds (per frame). Errors: kInvalidArgument for values that are negative or not finite.
[[nodiscard]] Result<void> set_turn_steps(const Lattice& lattice, double turn_range, double spin_range,
                                          double radius, CodecParameters& parameters);

/// Converts gravity (scene units / s^2) and damping (1/s) to the integers of the predicted step. Errors:
/// kInvalidArgument for values that are not finite or do not fit (|g| <= 2^28, 0 <= D < 2^16).
[[nodiscard]] Result<Drive> to_drive(const Lattice& lattice, const engine::Vec3& gravity,
                                     double damping_per_s);

}  // namespace tandem::host
