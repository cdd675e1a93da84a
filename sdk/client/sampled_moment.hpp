#pragma once
// Which moment a sample shows, and by which frames.

#include "sdk/client/picture.hpp"
#include "sdk/client/sample_columns.hpp"

namespace tandem::client {

/// A moment between two frames, or beyond the last one. All spans are in frames.
struct SampledMoment {
  /// Beyond the last frame bodies go on at full speed for so long, at least a frame: deltas that are late by
  /// less are no trouble.
  static constexpr double kFullSpeedS = 0.1;
  /// After that they slow down evenly, and stand at the end of so long.
  static constexpr double kSlowingS = 0.25;

  double frame = 0;                  ///< the moment
  const DrawnFrame* from = nullptr;  ///< the frame before it; null beyond the last one
  const DrawnFrame* at = nullptr;    ///< the frame at it or after it; the last one beyond that
  float after = 0;                   ///< from `at`, negative before it
  float pace = 1;                    ///< how fast the moment goes on by the clock, 0 to 1
  /// From the moment of the previous sample to the first that `from` and `at` tell of, and from there to this
  /// one.
  float gap = 0, since = 0;
  /// Frames that a free fall, which beyond the first frame changes velocity, multiplies gravity with: at this
  /// moment, and the part of it that came since the previous sample; and its velocity's.
  float fall = 0, fall_since = 0, fall_speed = 0;
};

/// `last_frame`: the moment of the previous sample, `elapsed` frames ago by the clock.
[[nodiscard]] SampledMoment moment_at(const Picture& picture, SampleMode mode, std::int64_t at_ns,
                                      double last_frame, double elapsed);

}  // namespace tandem::client
