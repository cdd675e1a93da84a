#pragma once
// The moment that a sample shows, and the frames that it is computed from.

#include "sdk/client/drawing/motion.hpp"
#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/drawing/sample_columns.hpp"

namespace tandem::client {

/// The effect on a motion of an acceleration of 1 that began some time ago: as Extra.
struct Acceleration {
  float place = 0, way = 0, speed = 0;
  [[nodiscard]] bool any() const { return place != 0 || way != 0; }
};

/// A moment between two frames, or beyond the last one. All times are in frames.
struct SampledMoment {
  /// Beyond the last frame bodies move on at full speed for this time, at least one frame. Deltas that are
  /// less late than that do not disturb the motion.
  static constexpr double kFullSpeedS = 0.1;
  /// After that they slow down evenly for this time, and then stand still.
  static constexpr double kSlowingS = 0.25;
  /// The effect of an echo grows for this time; after that an answer is unlikely.
  static constexpr double kEchoS = 0.25;

  double frame = 0;                  ///< the moment
  const DrawnFrame* from = nullptr;  ///< the frame before it; null beyond the last one, and at the first
  const DrawnFrame* at = nullptr;    ///< the frame at or after the moment; beyond the last frame, the last
                                     ///< one
  Span span;
  Acceleration fall;  ///< effect of gravity, beyond the first frame
  Acceleration echo;  ///< effect of the application's own gravity
  /// The acceleration that `echo` is multiplied with: 1/64 lattice unit per frame^2.
  std::array<float, kPositionChannels> echo_gravity{};
};

/// Chooses the moment. It is not before `least_frame`, as far as the picture reaches. `last_frame`: the
/// moment of the previous sample, which was `elapsed` frames ago by the clock.
[[nodiscard]] SampledMoment moment_at(const Picture& picture, SampleMode mode, std::int64_t at_ns,
                                      double least_frame, double last_frame, double elapsed);

}  // namespace tandem::client
