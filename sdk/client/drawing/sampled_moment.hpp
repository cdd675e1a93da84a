#pragma once
// Which moment a sample shows, and by which frames.

#include "sdk/client/drawing/motion.hpp"
#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/drawing/sample_columns.hpp"

namespace tandem::client {

/// What an acceleration of 1 that began some time ago makes of a motion: as Extra.
struct Acceleration {
  float place = 0, way = 0, speed = 0;
  [[nodiscard]] bool any() const { return place != 0 || way != 0; }
};

/// A moment between two frames, or beyond the last one. All times are in frames.
struct SampledMoment {
  /// Beyond the last frame bodies go on at full speed for so long, at least a frame: deltas that are late by
  /// less are no trouble.
  static constexpr double kFullSpeedS = 0.1;
  /// After that they slow down evenly, and stand at the end of so long.
  static constexpr double kSlowingS = 0.25;
  /// An echo grows for so long; an answer that takes longer is likely none.
  static constexpr double kEchoS = 0.25;

  double frame = 0;                  ///< the moment
  const DrawnFrame* from = nullptr;  ///< the frame before it; null beyond the last one, and at the first
  const DrawnFrame* at = nullptr;    ///< the frame at it or after it; the last one beyond that
  Span span;
  Acceleration fall;  ///< by gravity, beyond the first frame
  Acceleration echo;  ///< by an app's own
  /// What `echo` multiplies: 1/64 lattice unit per frame^2.
  std::array<float, kPositionChannels> echo_gravity{};
};

/// `last_frame`: the moment of the previous sample, `elapsed` frames ago by the clock.
[[nodiscard]] SampledMoment moment_at(const Picture& picture, SampleMode mode, std::int64_t at_ns,
                                      double last_frame, double elapsed);

}  // namespace tandem::client
